//! What a picture shows, read from the bag.

use std::path::Path;

use lgvi_dynamics::wheels::Wheels;
use lgvi_dynamics::{BodyState, Invariants, System};
use lgvi_middleware::node::NodeError;
use lgvi_msgs::msg::{self, SystemState};
use lgvi_propagator::Controls;
use lgvi_scene::{Maneuver, Scene, SceneError, Seen, Units};
use nalgebra::{Matrix3, Vector3};

use super::controls::Track;
use super::thin::Thinned;
use super::thrusters::{Firing, ThrusterRecord};
use super::wheels::{Wheel, WheelRecord};
use crate::bars;
use lgvi_review::FlightBag;

/// States that are kept at most; a longer flight is thinned out evenly.
const SAMPLES: usize = 1 << 16;

/// A flight in SI units.
pub(crate) struct FlightData {
    pub(crate) scene: Scene,
    /// States of it in the bag.
    pub(crate) recorded: u64,
    pub(crate) samples: Vec<Sample>,
    /// One a body.
    pub(crate) tracks: Vec<Track>,
    /// Whether states were set from outside.
    pub(crate) intervened: bool,
}

/// A recorded state and what follows from it.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    pub(crate) step: u64,
    /// Since the epoch (s).
    pub(crate) time: f64,
    pub(crate) bodies: Vec<Pose>,
    pub(crate) energy: Energy,
    /// Total, inertial frame (kg m/s).
    pub(crate) linear_momentum: Vector3<f64>,
    /// Total about the origin, inertial frame (kg m²/s).
    pub(crate) angular_momentum: Vector3<f64>,
    /// The wheels of the bodies that have some, by the index of the body.
    pub(super) wheels: Vec<(usize, Vec<Wheel>)>,
    /// The thrusters of the bodies that have some.
    pub(super) firings: Vec<Firing>,
}

/// Where a body is and how it turns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose {
    /// (m), inertial frame.
    pub(crate) position: Vector3<f64>,
    /// Body to inertial.
    pub(crate) attitude: Matrix3<f64>,
    /// Inertial frame (kg m/s).
    pub(crate) linear_momentum: Vector3<f64>,
    /// About the center of mass, body frame (kg m²/s).
    pub(crate) spin: Vector3<f64>,
    /// Angular velocity, body frame (rad/s).
    pub(crate) rate: Vector3<f64>,
    /// (m/s), inertial frame.
    pub(crate) velocity: Vector3<f64>,
}

/// Energy of all bodies (J).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Energy {
    pub(crate) translation: f64,
    pub(crate) rotation: f64,
    pub(crate) potential: f64,
    pub(crate) total: f64,
}

/// What the sequences of a flight have act on each body, each until a later one takes its place.
fn tracks(scene: &Scene, samples: &[Sample], controls: Vec<Controls>) -> Vec<Track> {
    let mut ends = vec![scene.steps; scene.bodies.len()];
    let mut acting: Vec<_> = controls
        .into_iter()
        .filter(|controls| !controls.loads.is_empty())
        .rev()
        .map(|controls| {
            let end = &mut ends[controls.body];
            let until = *end;
            *end = until.min(controls.first_step);
            (controls, until)
        })
        .collect();
    acting.reverse();
    let mut tracks = vec![Track::default(); scene.bodies.len()];
    for (controls, end) in acting {
        let body = controls.body;
        let attitude = |step, body: usize| {
            let next = samples.partition_point(|sample| sample.step <= step);
            samples[next.saturating_sub(1)].bodies[body].attitude
        };
        tracks[body].accept(&controls, end, attitude);
    }
    tracks
}

impl FlightData {
    /// Reads the flight in the bag at `path`, from its last reset on; every error is [`NodeError::Input`] and names bag and topic.
    pub(crate) fn read(path: &Path, flight: Option<&str>) -> Result<Self, NodeError> {
        let bag = FlightBag::open(path, flight)?;
        let scene = bag.scene.clone();
        let refuse =
            |error: String| NodeError::from(bag.refuse(&format!("{}: {error}", bag.state_topic())));
        let courses = bag.courses()?;
        let course = courses.last().ok_or_else(|| refuse("no states".into()))?;
        let mut system = scene.system();
        let actuators = (WheelRecord::read(&bag)?, ThrusterRecord::read(&bag)?);
        let mut samples = Thinned::new(SAMPLES);
        let (mut recorded, mut reached) = (0, None);
        let bar = bars::bar("reading", bag.state_count(), "states");
        for state in bag.states_of(course.samples.clone()) {
            let state = state?;
            bar.inc(1);
            let step = state.step;
            let set = course
                .set
                .binary_search_by_key(&state.sequence, |(sample, _)| *sample);
            if let Some(before) = reached.filter(|before| *before >= step && set.is_err()) {
                return Err(refuse(format!("step {step} follows step {before}")));
            }
            recorded += 1;
            reached = Some(step);
            let sample = sample(&scene, &mut system, &actuators, &state);
            let sample = sample.map_err(|error| refuse(format!("step {step}: {error}")))?;
            if let Some(sample) = sample {
                samples.push(sample);
            }
        }
        bar.finish_and_clear();
        let samples = samples.finish();
        if samples.is_empty() {
            let expected = match recorded {
                0 => "no states, expected at least one",
                _ => {
                    "no states of actuators beside the states, expected those of all bodies with wheels or thrusters"
                }
            };
            return Err(refuse(expected.into()));
        }
        let controls = bag.check(course.controls).collect::<Result<_, _>>()?;
        let tracks = tracks(&scene, &samples, controls);
        Ok(Self {
            scene: as_flown(scene, &samples).map_err(|error| refuse(error.to_string()))?,
            recorded,
            samples,
            tracks,
            intervened: !course.set.is_empty(),
        })
    }

    /// Whether controls acted or states were set.
    pub(super) fn is_disturbed(&self) -> bool {
        let fired = |sample: &Sample| sample.firings.iter().any(Firing::has_fired);
        self.intervened || !self.controlled().is_empty() || self.samples.iter().any(fired)
    }

    /// The first recorded state; there is always one.
    pub(crate) fn first(&self) -> &Sample {
        &self.samples[0]
    }

    /// The last recorded state.
    pub(crate) fn last(&self) -> &Sample {
        &self.samples[self.samples.len() - 1]
    }

    /// Indices of the bodies on which controls acted.
    pub(crate) fn controlled(&self) -> Vec<usize> {
        let end = self.last().step;
        (0..self.tracks.len())
            .filter(|body| !self.tracks[*body].is_empty(end))
            .collect()
    }

    /// Whether feedback or errors of the actuators changed the controls on a body that the tracks tell.
    pub(crate) fn is_inexact(&self, body: usize) -> bool {
        let mut planned = self.scene.maneuver.iter().flat_map(Maneuver::planned);
        let is_steered = planned.any(|planned| planned.body == body && planned.feedback);
        is_steered || self.scene.disturbance.is_some()
    }

    /// The cost of the flown controls, in the scene's units, with what it is a cost of; `None` without a maneuver or before
    /// its end.
    pub(crate) fn cost(&self) -> Option<(&'static str, f64)> {
        let maneuver = self.scene.maneuver.as_ref()?;
        let end = self.last().step;
        let is_missing = |planned: &Maneuver| self.tracks[planned.body].is_empty(end);
        if end < self.scene.steps || maneuver.planned().any(is_missing) {
            return None;
        }
        let h = self.scene.h();
        let costs = maneuver.planned().map(|planned| {
            // Every interval gives two corners.
            let stairs = self.tracks[planned.body].stairs(end);
            let costs = stairs.chunks(2).map(|interval| {
                let steps = interval[interval.len() - 1].0 - interval[0].0;
                steps as f64 * planned.interval_cost(&interval[0].1, h)
            });
            costs.sum::<f64>()
        });
        let kind = if self.is_inexact(maneuver.body) {
            "cost of the plans"
        } else {
            "cost"
        };
        Some((kind, costs.sum()))
    }
}

/// The recorded state, with the actuators in the system; `None` if their states are missing for it.
fn sample(
    scene: &Scene,
    system: &mut System,
    (wheels, thrusters): &(WheelRecord, ThrusterRecord),
    state: &SystemState,
) -> Result<Option<Sample>, String> {
    let (found, expected) = (state.bodies.len(), scene.bodies.len());
    if found != expected {
        return Err(format!("{found} bodies, the scene has {expected}"));
    }
    let units = &scene.units;
    let states: Vec<_> = state
        .bodies
        .iter()
        .map(|body| from_si(body, units))
        .collect();
    for ((state, message), named) in states.iter().zip(&state.bodies).zip(&scene.bodies) {
        if message.name != named.name {
            return Err(format!(
                "body {:?}, the scene has {:?}",
                message.name, named.name
            ));
        }
        if !state.is_finite() {
            return Err(format!("the state of {} is not finite", named.name));
        }
    }
    if !state.time.is_finite() {
        return Err(format!(
            "time is {} s, expected a finite number",
            state.time
        ));
    }
    let Some(firings) = thrusters.at(scene, state.step, system) else {
        return Ok(None);
    };
    let Some(wheels) = wheels.at(scene, state.step, &states, system) else {
        return Ok(None);
    };
    let invariants = Invariants::of(system, &states);
    if !invariants.energy.is_finite() || !invariants.angular_momentum.iter().all(|c| c.is_finite())
    {
        return Err("energy or angular momentum is not finite".into());
    }
    let mut energy = Energy {
        translation: 0.0,
        rotation: 0.0,
        potential: system.potential(&states) * units.energy(),
        total: invariants.energy * units.energy(),
    };
    let bodies = || system.bodies().iter().zip(&states);
    for (body, state) in bodies() {
        energy.translation +=
            0.5 * state.linear_momentum.dot(&state.velocity(body)) * units.energy();
        energy.rotation +=
            0.5 * state.angular_momentum.dot(&state.angular_velocity(body)) * units.energy();
        energy.rotation += body.wheels().map_or(0.0, Wheels::energy) * units.energy();
    }
    let poses = bodies()
        .zip(&state.bodies)
        .map(|((body, state), message)| Pose {
            position: message.position.into(),
            attitude: state.attitude,
            linear_momentum: message.linear_momentum.into(),
            spin: message.angular_momentum.into(),
            rate: state.angular_velocity(body) / units.time,
            velocity: state.velocity(body) * (units.length / units.time),
        });
    Ok(Some(Sample {
        step: state.step,
        time: state.time,
        bodies: poses.collect(),
        energy,
        linear_momentum: invariants.linear_momentum * units.momentum(),
        angular_momentum: invariants.angular_momentum * units.angular_momentum(),
        wheels,
        firings,
    }))
}

/// The scene, with its maneuver relative to where the other bodies were in the flight.
fn as_flown(scene: Scene, samples: &[Sample]) -> Result<Scene, SceneError> {
    let is_relative = |maneuver: &Maneuver| maneuver.planned().any(Maneuver::is_relative);
    if !scene.maneuver.as_ref().is_some_and(is_relative) {
        return Ok(scene);
    }
    let maneuver = scene.maneuver_seen(&seen(&scene.units, samples))?;
    Ok(Scene { maneuver, ..scene })
}

/// The recorded states in the scene's units.
fn seen(units: &Units, samples: &[Sample]) -> Vec<Seen> {
    let state = |pose: &Pose| BodyState {
        position: pose.position / units.length,
        linear_momentum: pose.linear_momentum / units.momentum(),
        attitude: pose.attitude,
        angular_momentum: pose.spin / units.angular_momentum(),
    };
    let seen = samples.iter().map(|sample| Seen {
        step: sample.step,
        states: sample.bodies.iter().map(state).collect(),
    });
    seen.collect()
}

/// A recorded state in the scene's units, which the system's constants are in.
fn from_si(body: &msg::BodyState, units: &Units) -> BodyState {
    BodyState {
        position: Vector3::from(body.position) / units.length,
        linear_momentum: Vector3::from(body.linear_momentum) / units.momentum(),
        attitude: Matrix3::from_row_slice(&body.attitude),
        angular_momentum: Vector3::from(body.angular_momentum) / units.angular_momentum(),
    }
}

#[cfg(test)]
impl FlightData {
    /// The first `steps` steps of a scene, with the same load in the scene's units on `pushed` all the time.
    pub(super) fn flown(
        text: &str,
        steps: u64,
        pushed: Option<(usize, lgvi_dynamics::Load)>,
    ) -> Self {
        let scene = Scene::parse("test", text).unwrap();
        let mut system = scene.system();
        let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
        let mut tracks = vec![Track::default(); scene.bodies.len()];
        let mut loads = vec![lgvi_dynamics::Load::default(); scene.bodies.len()];
        if let Some((body, load)) = pushed {
            loads[body] = load;
            let controls = Controls {
                body,
                first_step: 0,
                hold: steps,
                axes: lgvi_propagator::Axes::Split,
                loads: vec![load],
                actuation: None,
                law: None,
            };
            tracks[body].accept(&controls, steps, |_, _| Matrix3::identity());
        }
        let mut samples = Vec::new();
        for step in 0..=steps {
            let bodies = scene.bodies.iter().zip(simulation.states());
            let bodies = bodies.map(|(named, state)| {
                let si = scene.units.state_to_si(state);
                msg::BodyState {
                    name: named.name.clone(),
                    position: si.position.into(),
                    linear_momentum: si.linear_momentum.into(),
                    attitude: std::array::from_fn(|i| si.attitude[(i / 3, i % 3)]),
                    angular_momentum: si.angular_momentum.into(),
                }
            });
            let state = SystemState {
                step,
                time: scene.seconds(step),
                bodies: bodies.collect(),
                ..SystemState::default()
            };
            let sample = sample(&scene, &mut system, &Default::default(), &state);
            samples.extend(sample.unwrap());
            simulation.advance(&loads).unwrap();
        }
        Self {
            scene: as_flown(scene, &samples).unwrap(),
            recorded: samples.len() as u64,
            samples,
            tracks,
            intervened: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use lgvi_bag::{BagOptions, BagWriter, Qos, Topic};
    use lgvi_msgs::{RosMessage, cdr};
    use lgvi_scene::Scene;

    use super::*;
    use crate::plot::plot;

    const TEXT: &str = r#"
        title = "A <ball> & its units"
        [units]
        length = "10 m"
        mass = "2 kg"
        time = "5 s"
        [run]
        duration = 1.0
        steps = 4
        integrator = "lgvi"
        [gravity.central]
        gm = 1.0
        [[bodies]]
        name = "ball"
        mass = 1.0
        inertia = [1, 1, 1]
        position = [1, 0, 0]
        velocity = [0, 1, 0]
        attitude = { w = 1, x = 0, y = 0, z = 0 }
        angular_velocity = [0, 0, 1]
    "#;

    /// A state of the scene at `step` that has not moved.
    fn state(step: u64) -> SystemState {
        let scene = Scene::parse("test", TEXT).unwrap();
        let si = scene.units.state_to_si(&scene.bodies[0].state);
        let body = msg::BodyState {
            name: "ball".into(),
            position: si.position.into(),
            linear_momentum: si.linear_momentum.into(),
            attitude: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            angular_momentum: si.angular_momentum.into(),
        };
        SystemState {
            sequence: step,
            step,
            time: scene.seconds(step),
            bodies: vec![body],
            ..SystemState::default()
        }
    }

    /// A bag with the scene and these states.
    fn bag(states: &[SystemState]) -> (tempfile::TempDir, std::path::PathBuf) {
        fn topic<M: RosMessage>(name: &str) -> Topic {
            Topic {
                name: format!("/propagator/{name}"),
                type_name: M::TYPE_NAME.into(),
                type_hash: M::TYPE_HASH.into(),
                definition: M::DEFINITION.into(),
                definition_encoding: lgvi_bag::ROS2MSG.into(),
                qos: Qos::default(),
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag");
        let mut writer = BagWriter::create(&path, BagOptions::default()).unwrap();
        let scene = msg::Scene {
            name: "test".into(),
            text: TEXT.into(),
            ..msg::Scene::default()
        };
        let scene_topic = writer.add_topic(&topic::<msg::Scene>("scene")).unwrap();
        writer
            .write(scene_topic, 0, 0, 0, &cdr::encode(&scene).unwrap())
            .unwrap();
        let state_topic = writer.add_topic(&topic::<SystemState>("state")).unwrap();
        for (time, state) in (1..).zip(states) {
            let data = cdr::encode(state).unwrap();
            writer.write(state_topic, time, time, 0, &data).unwrap();
        }
        writer.finish(BTreeMap::new()).unwrap();
        (folder, path)
    }

    #[test]
    fn a_bag_is_read_in_si_and_drawn_the_same_each_time() {
        let (_folder, path) = bag(&[state(0), state(2), state(4)]);
        let flight = FlightData::read(&path, None).unwrap();
        assert_eq!(flight.last().step, 4);
        assert_eq!(flight.last().time, 5.0);
        assert_eq!(
            flight.first().bodies[0].position,
            Vector3::new(10.0, 0.0, 0.0)
        );
        // m = 2 kg at 2 m/s and J = 200 kg m² at 0.2 rad/s; GM = 10³/5² m³/s² at 10 m.
        let energy = flight.first().energy;
        assert!((energy.translation - 4.0).abs() < 1e-12, "{energy:?}");
        assert!((energy.rotation - 4.0).abs() < 1e-12, "{energy:?}");
        assert!((energy.potential + 8.0).abs() < 1e-12, "{energy:?}");
        assert!(energy.total.abs() < 1e-12, "{energy:?}");
        let momentum = flight.first().angular_momentum;
        assert!(
            (momentum - Vector3::new(0.0, 0.0, 80.0)).norm() < 1e-12,
            "{momentum}"
        );

        let picture = std::fs::read(plot(&path, None, None).unwrap()).unwrap();
        let again = path.with_file_name("again.svg");
        plot(&path, None, Some(&again)).unwrap();
        assert!(
            std::fs::read(again).unwrap() == picture,
            "pictures of one bag differ"
        );
        let text = String::from_utf8(picture).unwrap();
        assert!(text.contains("<title>A &lt;ball> &amp; its units</title>"));
        assert!(!text.contains("NaN"));
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_with_bag_topic_and_step() {
        let refused = |states: &[SystemState]| {
            let (_folder, path) = bag(states);
            match FlightData::read(&path, None) {
                Err(NodeError::Input(text)) => {
                    assert!(text.contains(&*path.to_string_lossy()), "{text}");
                    assert!(text.contains("/propagator/state"), "{text}");
                    text
                }
                Err(other) => panic!("{other:?}"),
                Ok(_) => panic!("accepted"),
            }
        };
        assert!(refused(&[]).contains("no states"));
        assert!(refused(&[state(2), state(1)]).contains("step 1 follows step 2"));
        let mut wrong = state(3);
        wrong.bodies[0].angular_momentum[1] = f64::NAN;
        let text = refused(&[state(0), wrong.clone()]);
        assert!(
            text.contains("step 3: the state of ball is not finite"),
            "{text}"
        );
        wrong.bodies.clear();
        assert!(refused(&[wrong]).contains("0 bodies, the scene has 1"));
        let mut wrong = state(0);
        wrong.bodies[0].name = "moon".into();
        assert!(refused(&[wrong]).contains("body \"moon\", the scene has \"ball\""));
    }
}
