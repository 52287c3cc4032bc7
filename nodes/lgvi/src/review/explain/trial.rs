//! The first steps of a scene, flown without publishing anything.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use lgvi_dynamics::gravity::Gravity;
use lgvi_dynamics::{BodyState, Load, Method, RigidBody, Simulation, System};
use lgvi_scene::{Energies, Rates, Scene, Scheme};

use crate::Unusable;

/// Steps of the method at most, a fraction of a second.
const STEPS: u64 = 2000;

/// How often it is looked how fast bodies move round each other, which takes as long as their gravity.
const LOOKS: u64 = 200;

/// What the first steps of a scene have shown; the method's own steps, none of them cut.
pub(super) struct Trial {
    /// Steps of the run made.
    pub(super) steps: u64,
    /// Evaluations of gravity a step of the method, 0 of one that does not evaluate it.
    pub(super) evaluations: f64,
    /// Greatest turn of a body in a step of the method (rad).
    pub(super) largest_turn: f64,
    /// How fast bodies have moved.
    pub(super) rates: Rates,
    /// At the start and at the end.
    pub(super) energies: [Energies; 2],
    /// Why it ended early.
    pub(super) failure: Option<String>,
}

/// Counts how often gravity is asked for loads.
struct Counter(Arc<AtomicU64>);

impl Gravity for Counter {
    fn add_loads(&mut self, _: &[RigidBody], _: &[BodyState], _: &mut [Load]) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    fn potential(&self, _: &[RigidBody], _: &[BodyState]) -> f64 {
        0.0
    }
}

impl Trial {
    pub(super) fn fly(scene: &Scene, scheme: Scheme) -> Result<Self, Unusable> {
        let counter = Arc::new(AtomicU64::new(0));
        let mut gravity = scene.gravity.of_system();
        // Taylor series have no loads.
        let asks = !matches!(scheme.method, Method::Taylor { .. });
        if asks && !gravity.is_empty() {
            gravity.push(Box::new(Counter(Arc::clone(&counter))));
        }
        let bodies: Vec<_> = scene
            .bodies
            .iter()
            .map(|named| named.body.clone())
            .collect();
        let states = scene.bodies.iter().map(|named| named.state).collect();
        let system = System::new(bodies, gravity);
        let mut simulation = Simulation::new(system, states, scheme.method, scene.h())
            .map_err(Unusable::new)?
            .with_substeps(scheme.substeps);

        let substeps = u64::from(scheme.substeps);
        let wanted = (STEPS / substeps).clamp(1, scene.steps);
        let controls = vec![Load::default(); scene.bodies.len()];
        let h = scene.h() / f64::from(scheme.substeps);
        let mut trial = Self {
            steps: 0,
            evaluations: 0.0,
            largest_turn: turn(&simulation, h),
            rates: scene.rates(simulation.system(), simulation.states()),
            energies: [Energies::of(simulation.system(), simulation.states()); 2],
            failure: None,
        };
        let before = counter.load(Ordering::Relaxed);
        while trial.steps < wanted && trial.failure.is_none() {
            match simulation.advance(&controls) {
                Ok(_) => trial.steps += 1,
                Err(error) => {
                    let error = scene.step_error(&error);
                    let cut = if scene.subdivides(scheme) {
                        " (it will be cut)"
                    } else {
                        ""
                    };
                    trial.failure = Some(format!("step {}: {error}{cut}", trial.steps));
                }
            }
            trial.largest_turn = trial.largest_turn.max(turn(&simulation, h));
            if trial.steps.is_multiple_of(wanted.div_ceil(LOOKS)) {
                trial.rates = trial
                    .rates
                    .max(scene.rates(simulation.system(), simulation.states()));
            }
        }
        trial.energies[1] = Energies::of(simulation.system(), simulation.states());
        trial.rates.turn = trial.largest_turn / h;
        let evaluations = counter.load(Ordering::Relaxed) - before;
        trial.evaluations = evaluations as f64 / (trial.steps * substeps).max(1) as f64;
        Ok(trial)
    }
}

/// The greatest `h |Ω|` over the bodies that turn by themselves (rad).
fn turn(simulation: &Simulation, h: f64) -> f64 {
    let bodies = simulation.system().bodies().iter().zip(simulation.states());
    bodies
        .filter(|(body, _)| !body.mobility().is_given())
        .map(|(body, state)| h * state.angular_velocity(body).norm())
        .fold(0.0, f64::max)
}
