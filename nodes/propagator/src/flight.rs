use std::sync::Arc;

use lgvi_dynamics::docking::Docked;
use lgvi_dynamics::{
    ActuatorStates, BodyState, Invariants, Load, MethodError, Simulation, StepError, StepReport,
    System,
};
use lgvi_scene::{ActuatorErrors, Energies, MAX_THRUSTERS, Scene, Scheme, SchemeError};
use thiserror::Error;

use crate::target::Actuators;
use crate::target::Target;
use crate::{ControlError, Controls, SetStates};

/// The most sequences that are kept for one body.
const SEQUENCES: usize = 64;

/// The efforts of actuators that nobody commands, of as many as a body can have.
const NO_EFFORTS: [f64; MAX_THRUSTERS] = [0.0; MAX_THRUSTERS];

/// The most memory that the sequences of all bodies may take (byte).
const MEMORY: usize = 512 << 20;

/// A scene on its way under the control sequences accepted so far.
///
/// A sequence acts on its body from its first step on, in place of any accepted before it. What acts in each step is its
/// control, corrected by its feedback law if it has one, with the errors of the scene's disturbance if it has one.
pub struct Flight {
    simulation: Simulation,
    scheme: Scheme,
    /// Substeps above which a step was cut; none where steps are never cut.
    whole: Option<u32>,
    /// Accepted sequences by target, oldest first; those that can no longer act are dropped.
    accepted: Vec<Vec<Arc<Controls>>>,
    /// Which body's controls act other than they are meant, and by how much.
    errors: Option<(usize, ActuatorErrors)>,
    loads: Vec<Load>,
    /// The scene's steps.
    steps: u64,
    /// The actuators of all bodies, and how many.
    actuators: Vec<(Actuators, usize, usize)>,
}

/// States that a flight cannot go on from.
#[derive(Debug, Error)]
pub enum SetStatesError {
    /// They are not those of rigid bodies.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// What flies the scene cannot fly them.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// The step from them cannot be made.
    #[error("no step can be made from these states: {0}")]
    Step(String),
    /// A step from them leaves the range of numbers in SI.
    #[error("a step from these states leads to states or an energy that are not finite in SI")]
    Range,
    /// Bodies that are too fast, or at one point.
    #[error("the energy of these states is not finite")]
    Energy,
}

impl Flight {
    /// At step 0 of `scene`.
    pub fn new(scene: &Scene) -> Result<Self, SchemeError> {
        let scheme = scene.scheme()?;
        Ok(Self::of(scene, scheme, scene.simulation(scheme)?))
    }

    /// At the present step of a simulation of `scene` by this scheme, such as one under other gravity.
    pub fn of(scene: &Scene, scheme: Scheme, simulation: Simulation) -> Self {
        let bodies = scene.bodies.len();
        Self {
            simulation,
            scheme,
            whole: scene.subdivides(scheme).then_some(scheme.substeps),
            // So that accepting a sequence on the way allocates nothing.
            accepted: (0..Target::count(bodies))
                .map(|_| Vec::with_capacity(SEQUENCES))
                .collect(),
            errors: scene.actuator_errors(),
            loads: vec![Load::default(); bodies],
            steps: scene.steps,
            actuators: (0..bodies)
                .flat_map(|body| [(Actuators::Wheels, body), (Actuators::Thrusters, body)])
                .map(|(actuators, body)| (actuators, body, actuators.of(scene, body).len()))
                .filter(|(.., count)| *count > 0)
                .collect(),
        }
    }

    /// How often an interaction has been taken up in more or in less detail since the last reset.
    pub fn switches(&self) -> u64 {
        self.simulation.switches()
    }

    /// What flies it.
    pub fn scheme(&self) -> Scheme {
        self.scheme
    }

    /// Takes a sequence from outside into account; refuses one that could never act, or that there is no room for.
    pub fn admit(&mut self, controls: impl Into<Arc<Controls>>) -> Result<(), ControlError> {
        let controls = controls.into();
        let (first_step, steps) = (controls.first_step, self.steps);
        self.check_in_time(first_step)?;
        if first_step >= steps {
            return Err(ControlError::Beyond { first_step, steps });
        }
        let channel = self.channel(&controls);
        self.drop_past(channel);
        let replaced = |earlier: &&Arc<Controls>| earlier.first_step >= first_step;
        let channels = self.accepted.iter().enumerate();
        let kept: usize = channels
            .flat_map(|(other, accepted)| {
                let stays = move |earlier: &&Arc<Controls>| other != channel || !replaced(earlier);
                accepted.iter().filter(stays)
            })
            .map(|earlier| earlier.size())
            .sum();
        let accepted = self.accepted[channel].iter();
        if accepted.filter(|earlier| !replaced(earlier)).count() >= SEQUENCES {
            return Err(ControlError::TooMany { limit: SEQUENCES });
        }
        if kept.saturating_add(controls.size()) > MEMORY {
            return Err(ControlError::TooLarge {
                size: controls.size(),
                kept,
                limit: MEMORY,
            });
        }
        self.accept(controls)
    }

    /// Takes a sequence into account; refuses one that would have had to start in the past.
    ///
    /// Sequences that can no longer act are let go of. Their memory is given back here unless somebody else holds them.
    pub fn accept(&mut self, controls: impl Into<Arc<Controls>>) -> Result<(), ControlError> {
        let controls = controls.into();
        let first_step = controls.first_step;
        self.check_in_time(first_step)?;
        let channel = self.channel(&controls);
        self.drop_past(channel);
        let accepted = &mut self.accepted[channel];
        accepted.retain(|earlier| earlier.first_step < first_step);
        accepted.push(controls);
        Ok(())
    }

    /// Which of the accepted sequences a sequence is among: those with its target.
    fn channel(&self, controls: &Controls) -> usize {
        controls.target().index(self.loads.len())
    }

    /// Lets go of the sequences of a channel that others have taken the place of.
    fn drop_past(&mut self, channel: usize) {
        let step = self.simulation.step();
        let accepted = &mut self.accepted[channel];
        let acting = accepted
            .iter()
            .rposition(|earlier| earlier.first_step <= step)
            .unwrap_or(0);
        accepted.drain(..acting);
    }

    fn check_in_time(&self, first_step: u64) -> Result<(), ControlError> {
        let step = self.simulation.step();
        if first_step < step {
            return Err(ControlError::Late { first_step, step });
        }
        Ok(())
    }

    /// Begins anew at step 0, without any sequence.
    pub fn reset(&mut self, scene: &Scene) -> Result<(), SchemeError> {
        self.simulation = scene.simulation(self.scheme)?;
        self.accepted.iter_mut().for_each(Vec::clear);
        self.loads.fill(Load::default());
        Ok(())
    }

    /// Whether a step can be made from other states of some bodies at the present step: it is made on the side.
    ///
    /// # Assumptions and limitations
    /// What may come after that step is not looked at.
    pub fn try_states(&self, scene: &Scene, states: &SetStates) -> Result<(), SetStatesError> {
        let mut all = self.simulation.states().to_vec();
        states.write(&mut all);
        let mut trial = scene.simulation_from(all, self.scheme)?;
        trial.set_actuator_states(&ActuatorStates::of(self.system()));
        let mut loads = self.loads.clone();
        self.command(&mut loads, trial.states());
        command_actuators(&mut trial, &self.actuators, &self.accepted, self.step());
        trial
            .advance(&loads)
            .map_err(|error| SetStatesError::Step(scene.step_error(&error)))?;
        let units = &scene.units;
        let energy = trial.invariants().energy * units.energy();
        let mut states = trial.states().iter();
        if energy.is_finite() && states.all(|state| units.state_to_si(state).is_finite()) {
            Ok(())
        } else {
            Err(SetStatesError::Range)
        }
    }

    /// Goes on from other states of some bodies at the present step; where they cannot be, nothing changes. Bodies that have
    /// docked separate, and dock again where their ports still meet.
    pub fn set_states(&mut self, states: &SetStates) -> Result<(), SetStatesError> {
        let system = self.simulation.system();
        let mut all = self.simulation.states().to_vec();
        states.write(&mut all);
        system.constrain(&mut all);
        if !Invariants::of(system, &all).energy.is_finite() {
            return Err(SetStatesError::Energy);
        }
        Ok(self.simulation.set_states(&all)?)
    }

    /// The dockings that have taken place since the last reset.
    pub fn docked(&self) -> &[Docked] {
        self.simulation.docked()
    }

    /// Whether a sequence has been accepted for `body`.
    pub fn commanded(&self, body: usize) -> bool {
        !self.accepted[body].is_empty()
    }

    /// Whether a sequence acts on a target in the present step.
    #[cfg(feature = "node")]
    pub(crate) fn acts(&self, target: Target) -> bool {
        let step = self.simulation.step();
        let channel = target.index(self.loads.len());
        let mut latest = self.accepted[channel].iter().rev();
        latest
            .find(|controls| controls.first_step <= step)
            .is_some_and(|controls| step < controls.end())
    }

    /// Whether a sequence of `body` that begins at `step` has been accepted and will act, or acts.
    pub fn has_sequence_from(&self, body: usize, step: u64) -> bool {
        let mut accepted = self.accepted[body].iter();
        accepted.any(|controls| controls.first_step == step)
    }

    /// The step at which the sequence of `body` that acts last ends.
    pub fn sequence_end(&self, body: usize) -> Option<u64> {
        Some(self.accepted[body].last()?.end())
    }

    /// Makes one step. Allocates nothing.
    pub fn advance(&mut self) -> Result<StepReport, StepError> {
        let mut loads = std::mem::take(&mut self.loads);
        self.command(&mut loads, self.simulation.states());
        self.loads = loads;
        let step = self.simulation.step();
        command_actuators(&mut self.simulation, &self.actuators, &self.accepted, step);
        self.simulation.advance(&self.loads)
    }

    /// What the accepted sequences have act in the present step, from these states.
    fn command(&self, loads: &mut [Load], states: &[BodyState]) {
        let step = self.simulation.step();
        for (load, accepted) in loads.iter_mut().zip(&self.accepted) {
            *load = accepted
                .iter()
                .rev()
                .find_map(|controls| controls.at(step, states))
                .unwrap_or_default();
        }
        if let Some((body, errors)) = &self.errors {
            loads[*body] = errors.apply(&loads[*body]);
        }
    }

    /// Into how many steps one with this report was cut because it could not be made as one; `None` where it could.
    pub fn cut(&self, report: StepReport) -> Option<u32> {
        self.whole
            .is_some_and(|whole| report.cuts > whole)
            .then_some(report.cuts)
    }

    /// What acted on the bodies in the last step, beside gravity.
    pub fn loads(&self) -> &[Load] {
        &self.loads
    }

    /// The bodies and their gravity.
    pub fn system(&self) -> &System {
        self.simulation.system()
    }

    /// The bodies' states.
    pub fn states(&self) -> &[BodyState] {
        self.simulation.states()
    }

    /// Steps made.
    pub fn step(&self) -> u64 {
        self.simulation.step()
    }

    /// The energies of the present states, in the scene's units.
    pub fn energies(&self) -> Energies {
        Energies::of(self.simulation.system(), self.simulation.states())
    }

    /// The invariants of the present states, in the scene's units.
    pub fn invariants(&self) -> Invariants {
        self.simulation.invariants()
    }
}

/// Commands the actuators of a simulation for its next step, which is this one of the flight. `accepted` are the sequences by
/// target.
fn command_actuators(
    simulation: &mut Simulation,
    all: &[(Actuators, usize, usize)],
    accepted: &[Vec<Arc<Controls>>],
    step: u64,
) {
    let bodies = simulation.states().len();
    for &(actuators, body, count) in all {
        let channel = Target::Actuators(actuators, body).index(bodies);
        let mut latest = accepted[channel].iter().rev();
        let given = latest.find_map(|controls| controls.efforts_during(step));
        let given = given.filter(|efforts| !efforts.is_empty());
        let efforts = given.unwrap_or(&NO_EFFORTS[..count]);
        match actuators {
            Actuators::Wheels => simulation.set_wheel_commands(body, efforts),
            Actuators::Thrusters => simulation.set_thruster_commands(body, efforts),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use lgvi_msgs::geometry_msgs;
    use lgvi_msgs::msg::ControlSequence;
    use nalgebra::Vector3;

    use super::*;

    pub(crate) fn scene() -> Scene {
        let text = r#"
            title = "A ball"
            [units]
            length = "2 m"
            [run]
            duration = 1.0
            steps = 10
            integrator = "lie_euler"
            [[bodies]]
            name = "ball"
            mass = 1.0
            inertia = [1, 1, 1]
            position = [0, 0, 0]
            velocity = [0, 0, 0]
            attitude = { w = 1, x = 0, y = 0, z = 0 }
            angular_velocity = [0, 0, 0]
        "#;
        Scene::parse("test", text).unwrap()
    }

    fn push(first_step: u64, force: f64, times: usize) -> ControlSequence {
        let force = geometry_msgs::Vector3 {
            x: force,
            ..Default::default()
        };
        ControlSequence {
            body: "ball".into(),
            first_step,
            step_size: 0.1,
            force: vec![force; times],
            moment: vec![Default::default(); times],
            ..Default::default()
        }
    }

    fn controls(first_step: u64, force: f64, times: usize) -> Controls {
        Controls::of_message(&scene(), &push(first_step, force, times)).unwrap()
    }

    /// Momentum gained in each of ten steps, in units of h × scene force.
    fn momentum_gains(flight: &mut Flight) -> Vec<f64> {
        let momentum = |flight: &Flight| flight.states()[0].linear_momentum.x;
        (flight.step()..10)
            .map(|_| {
                let before = momentum(flight);
                flight.advance().unwrap();
                ((momentum(flight) - before) / 0.1).round()
            })
            .collect()
    }

    #[test]
    fn a_sequence_acts_from_its_first_step_for_its_length_in_si() {
        let mut flight = Flight::new(&scene()).unwrap();
        flight.accept(controls(2, 6.0, 3)).unwrap();
        assert!(flight.commanded(0));
        let expected = [0.0, 0.0, 3.0, 3.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(momentum_gains(&mut flight), expected);
        assert_eq!(flight.loads()[0].force, Vector3::zeros());
    }

    #[test]
    fn an_interval_may_last_several_steps() {
        let mut message = push(1, 2.0, 2);
        message.step_size = 0.3;
        message.force[1].x = 4.0;
        let mut flight = Flight::new(&scene()).unwrap();
        flight
            .accept(Controls::of_message(&scene(), &message).unwrap())
            .unwrap();
        assert_eq!(flight.sequence_end(0), Some(7));
        let expected = [0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0];
        assert_eq!(momentum_gains(&mut flight), expected);
    }

    #[test]
    fn forces_in_the_frame_of_the_body_turn_with_it() {
        let scene = scene();
        let mut flight = Flight::new(&scene).unwrap();
        // A quarter turn about z: the x axis of the body points along y.
        let turned = lgvi_msgs::msg::BodyState {
            name: "ball".into(),
            attitude: [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            ..Default::default()
        };
        let turned = SetStates::of_message(&scene, &[turned]).unwrap();
        flight.set_states(&turned).unwrap();
        let mut message = push(0, 2.0, 1);
        message.header.frame_id = "ball".into();
        let controls = Controls::of_message(&scene, &message).unwrap();
        flight.accept(controls).unwrap();
        flight.advance().unwrap();
        assert_eq!(flight.loads()[0].force, Vector3::new(0.0, 1.0, 0.0));
    }

    #[test]
    fn a_later_sequence_takes_over_at_its_first_step() {
        let mut flight = Flight::new(&scene()).unwrap();
        flight.accept(controls(0, 2.0, 10)).unwrap();
        flight.accept(controls(8, 8.0, 10)).unwrap();
        assert!(flight.has_sequence_from(0, 8));
        flight.accept(controls(4, 4.0, 3)).unwrap();
        let begins = [0, 4, 5, 8].map(|step| flight.has_sequence_from(0, step));
        assert_eq!(begins, [true, true, false, false]);
        let expected = [1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0];
        assert_eq!(momentum_gains(&mut flight), expected);
    }

    /// Of a body that is set, spinning about z by so much in SI.
    fn spinning(scene: &Scene, angular_momentum: f64) -> SetStates {
        let mut message = lgvi_msgs::msg::BodyState {
            name: "ball".into(),
            attitude: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            ..Default::default()
        };
        message.angular_momentum[2] = angular_momentum;
        SetStates::of_message(scene, &[message]).unwrap()
    }

    /// A turn of more than 1 rad a step cannot be made, nor can one that leaves the range of numbers.
    #[test]
    fn states_from_which_no_step_can_be_made_are_told_apart() {
        let scene = scene();
        let mut flight = Flight::new(&scene).unwrap();
        flight.accept(controls(0, 6.0, 3)).unwrap();
        let before = flight.states().to_vec();
        for (angular_momentum, part) in [
            (1e3, "no step can be made from these states: ball: "),
            (1e200, "no step can be made from these states: ball: "),
        ] {
            let error = flight
                .try_states(&scene, &spinning(&scene, angular_momentum))
                .unwrap_err()
                .to_string();
            assert!(error.starts_with(part), "{error}");
        }
        let flown = spinning(&scene, 4.0);
        flight.try_states(&scene, &flown).unwrap();
        assert_eq!((flight.states(), flight.step()), (&*before, 0));
        flight.set_states(&flown).unwrap();
        flight.advance().unwrap();
    }

    #[test]
    fn a_sequence_in_the_past_is_refused() {
        let mut flight = Flight::new(&scene()).unwrap();
        flight.advance().unwrap();
        let refused = flight.accept(controls(0, 1.0, 10));
        assert_eq!(
            refused,
            Err(ControlError::Late {
                first_step: 0,
                step: 1
            })
        );
        flight.accept(controls(1, 1.0, 1)).unwrap();
    }

    #[test]
    fn a_sequence_that_begins_when_the_flight_is_over_is_refused() {
        let mut flight = Flight::new(&scene()).unwrap();
        for first_step in [10, u64::MAX] {
            let refused = flight.admit(controls(first_step, 1.0, 10));
            let expected = ControlError::Beyond {
                first_step,
                steps: 10,
            };
            assert_eq!(refused, Err(expected));
        }
        assert!(!flight.commanded(0));
        flight.admit(controls(9, 1.0, 10)).unwrap();
        assert_eq!(flight.sequence_end(0), Some(19));
    }

    #[test]
    fn a_sequence_without_end_ends_after_all_steps() {
        let mut flight = Flight::new(&scene()).unwrap();
        flight.accept(controls(u64::MAX, 1.0, 10)).unwrap();
        assert_eq!(flight.sequence_end(0), Some(u64::MAX));
    }

    #[test]
    fn no_more_sequences_wait_than_there_is_room_for() {
        let mut flight = Flight::new(&Scene {
            steps: 1000,
            ..scene()
        })
        .unwrap();
        for first_step in 0..SEQUENCES as u64 {
            flight.admit(controls(first_step, 1.0, 1)).unwrap();
        }
        let next = SEQUENCES as u64;
        let refused = flight.admit(controls(next, 1.0, 1));
        assert_eq!(refused, Err(ControlError::TooMany { limit: SEQUENCES }));
        flight.admit(controls(next - 1, 1.0, 1)).unwrap();
        flight.advance().unwrap();
        flight.admit(controls(next, 1.0, 1)).unwrap();
    }

    #[test]
    fn what_waits_takes_no_more_memory_than_is_allowed() {
        let mut flight = Flight::new(&Scene {
            steps: 1000,
            ..scene()
        })
        .unwrap();
        let long = Arc::new(Controls {
            loads: vec![Load::default(); 1_000_000],
            ..controls(0, 1.0, 1)
        });
        let fit = MEMORY / long.size();
        let at = |first_step: usize| Controls {
            first_step: first_step as u64,
            ..Controls::clone(&long)
        };
        for first_step in 0..fit {
            flight.admit(at(first_step)).unwrap();
        }
        let refused = flight.admit(at(fit));
        let expected = ControlError::TooLarge {
            size: long.size(),
            kept: fit * long.size(),
            limit: MEMORY,
        };
        assert_eq!(refused, Err(expected));
        flight.admit(at(fit - 1)).unwrap();
    }

    #[test]
    fn wrong_sequences_are_refused_with_field_and_value() {
        let check = |spoil: fn(&mut ControlSequence)| {
            let mut message = push(0, 1.0, 3);
            spoil(&mut message);
            Controls::of_message(&scene(), &message)
                .unwrap_err()
                .to_string()
        };
        assert_eq!(
            check(|m| m.body = "moon".into()),
            "`body` is \"moon\", expected one of ball"
        );
        assert_eq!(
            check(|m| m.step_size = 0.25),
            "`step_size` is 0.25 s, expected the scene's step 0.1 s or a whole number of them"
        );
        assert!(check(|m| m.step_size = f64::NAN).contains("NaN"));
        assert!(check(|m| (m.force, m.moment) = Default::default()).contains("empty"));
        assert_eq!(
            check(|m| m.moment.truncate(2)),
            "3 elements in `force` and 2 in `moment`, expected the same number"
        );
        assert_eq!(
            check(|m| m.moment[2].y = f64::INFINITY),
            "`moment[2]` is [0.0, inf, 0.0], expected three finite numbers"
        );
        assert_eq!(
            check(|m| m.header.frame_id = "moon".into()),
            "`header.frame_id` is \"moon\", expected one of inertial, ball"
        );
        let text = check(|m| m.header.stamp.nanosec = 1_000_000_000);
        assert!(text.starts_with("`header.stamp`: "), "{text}");
    }
}
