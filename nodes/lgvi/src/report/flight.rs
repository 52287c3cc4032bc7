//! What a bag tells over time, for the page.

use lgvi_dynamics::Load;
use lgvi_scene::Scene;
use serde::Serialize;

use super::packed::{FrameMotion, Packed};
use super::scenery::Scenery;
use crate::plot::data::{FlightData, Sample};
use crate::plot::thin::even;

/// States that a page holds at most, counted once a body; but it has never fewer than [`FEWEST`] instants.
const STATES: usize = 20_000;
const FEWEST: usize = 200;

/// Intervals of controls of a body that a page holds at most.
const INTERVALS: usize = 10_000;

/// A flight in SI units.
#[derive(Serialize)]
pub(super) struct Flight<'a> {
    pub(super) title: &'a str,
    /// Short name of the scene.
    name: &'a str,
    integrator: String,
    /// Step of the last state.
    steps: u64,
    /// Cost of the maneuver, in the scene's units, and what it is a cost of.
    cost: Option<(&'static str, f64)>,
    /// States in the bag, and those here.
    recorded: u64,
    shown: usize,
    /// Time since the epoch (s) of each state.
    time: Packed,
    bodies: Vec<Motion>,
    energy: Energy,
    /// Totals, inertial frame: linear (kg m/s), and angular about the origin (kg m²/s).
    linear_momentum: Packed,
    angular_momentum: Packed,
    controls: Vec<Controls>,
    scenery: Scenery<'a>,
}

/// The states of a body.
#[derive(Default, Serialize)]
struct Motion {
    #[serde(flatten)]
    frame: FrameMotion,
    /// (kg m/s), inertial frame.
    linear_momentum: Packed,
    /// (kg m²/s), body frame, about the center of mass or the pivot.
    angular_momentum: Packed,
    #[serde(flatten)]
    rates: Option<Rates>,
}

/// What does not follow from the momenta where mass and inertia change.
#[derive(Default, Serialize)]
struct Rates {
    /// (m/s), inertial frame.
    velocity: Packed,
    /// (rad/s), body frame.
    angular_velocity: Packed,
}

/// Energies of all bodies (J).
#[derive(Default, Serialize)]
struct Energy {
    translation: Packed,
    rotation: Packed,
    potential: Packed,
    total: Packed,
}

/// What the flown control sequences did to a body, interval by interval, constant in each.
#[derive(Serialize)]
struct Controls {
    body: usize,
    /// Start of each interval (s), and the end of the last.
    time: Packed,
    /// (N), inertial frame.
    force: Packed,
    /// (N m), body frame.
    moment: Packed,
    /// Whether feedback or errors of the actuators added something.
    inexact: bool,
    /// Whether intervals are left out.
    thinned: bool,
}

impl<'a> Flight<'a> {
    pub(super) fn of(data: &'a FlightData) -> Self {
        let scene = &data.scene;
        let limit = (STATES / scene.bodies.len().max(1)).max(FEWEST);
        let chosen = even(data.samples.len(), limit);
        let samples: Vec<&Sample> = chosen.iter().map(|k| &data.samples[*k]).collect();
        let mut flight = Self {
            title: &scene.title,
            name: &scene.name,
            integrator: scene.integration.to_string(),
            steps: data.last().step,
            cost: data.cost(),
            recorded: data.recorded,
            shown: samples.len(),
            time: Packed::default(),
            bodies: Vec::new(),
            energy: Energy::default(),
            linear_momentum: Packed::of(samples.iter().map(|sample| &sample.linear_momentum)),
            angular_momentum: Packed::of(samples.iter().map(|sample| &sample.angular_momentum)),
            controls: data
                .controlled()
                .into_iter()
                .map(|body| controls(data, body))
                .collect(),
            scenery: Scenery::of(data, &samples),
        };
        for sample in &samples {
            flight.time.push(&[sample.time]);
            let energy = &sample.energy;
            flight.energy.translation.push(&[energy.translation]);
            flight.energy.rotation.push(&[energy.rotation]);
            flight.energy.potential.push(&[energy.potential]);
            flight.energy.total.push(&[energy.total]);
        }
        let bodies = 0..scene.bodies.len();
        flight.bodies = bodies.map(|body| motion(scene, &samples, body)).collect();
        flight
    }

    /// How many states there are here.
    pub(super) fn shown(&self) -> usize {
        self.shown
    }
}

fn motion(scene: &Scene, samples: &[&Sample], body: usize) -> Motion {
    let mut motion = Motion {
        rates: scene.bodies[body].has_propellant().then(Rates::default),
        ..Motion::default()
    };
    for sample in samples {
        let pose = &sample.bodies[body];
        motion.frame.push(&pose.position, &pose.attitude);
        motion.linear_momentum.push(pose.linear_momentum.as_slice());
        motion.angular_momentum.push(pose.spin.as_slice());
        if let Some(rates) = &mut motion.rates {
            rates.velocity.push(pose.velocity.as_slice());
            rates.angular_velocity.push(pose.rate.as_slice());
        }
    }
    motion
}

fn controls(data: &FlightData, body: usize) -> Controls {
    let scene = &data.scene;
    let end = data.last().step;
    let stairs = data.tracks[body].stairs(end);
    // Every interval gives two corners.
    let intervals: Vec<(u64, Load)> = stairs.iter().step_by(2).copied().collect();
    let chosen = even(intervals.len(), INTERVALS);
    let mut controls = Controls {
        body,
        time: Packed::default(),
        force: Packed::default(),
        moment: Packed::default(),
        inexact: data.is_inexact(body),
        thinned: chosen.len() < intervals.len(),
    };
    for k in chosen {
        let (step, load) = &intervals[k];
        let load = scene.units.load_to_si(load);
        controls.time.push(&[scene.seconds(*step)]);
        controls.force.push(load.force.as_slice());
        controls.moment.push(load.moment.as_slice());
    }
    controls.time.push(&[scene.seconds(end)]);
    controls
}
