//! How far a maneuver's steps lead from the continuous motion under the same controls.

use std::iter::repeat_n;

use lgvi_dynamics::Accuracy;
use lgvi_dynamics::{BodyState, Load, Method, Simulation};

use crate::{Scene, Scheme};

/// Tolerance of what is taken for the continuous motion, of what is asked for.
const REFERENCE: f64 = 1e-3;

/// By how much fewer errors than are allowed are wanted of the steps that are said to do.
const MARGIN: f64 = 1.2;

/// The least such tolerance.
const FINEST: f64 = 1e-14;

impl Scene {
    /// The error at the end of a maneuver that `scheme` flies, constant `controls` acting on its body in each step: against
    /// the continuous motion under the same controls, as [`Accuracy`] measures it. Without controls it is that of the free
    /// flight until the end of the run. None without a maneuver, and where one of the two cannot be flown.
    pub fn discretization_error(&self, scheme: Scheme, controls: &[Load]) -> Option<f64> {
        let body = self.maneuver.as_ref()?.body;
        let start: Vec<_> = self.bodies.iter().map(|named| named.state).collect();
        let tolerance = REFERENCE * self.accuracy.unwrap_or(f64::EPSILON);
        let reference = Method::DormandPrince853 {
            tolerance: tolerance.max(FINEST),
        };
        let flown = self.simulation_from(start.clone(), scheme).ok()?;
        let simulate = |h| Simulation::new(self.system(), start.clone(), reference, h).ok();
        let (flown, truth) = if controls.is_empty() {
            let free = |steps| repeat_n(Load::default(), steps);
            // In one go: its steps are as long as they may be.
            let whole = fly(simulate(self.duration)?, body, free(1))?;
            (fly(flown, body, free(self.steps as usize))?, whole)
        } else {
            let controls = || controls.iter().copied();
            let truth = fly(simulate(self.h())?, body, controls())?;
            (fly(flown, body, controls())?, truth)
        };
        let system = self.system();
        Some(Accuracy::new(system.bodies(), &start).error(&flown, &truth))
    }

    /// What is to be said where a maneuver's steps lead farther from the continuous motion than `auto` was asked for.
    pub fn coarse_steps(&self, scheme: Scheme, controls: &[Load]) -> Option<String> {
        let accuracy = self.accuracy?;
        let error = self.discretization_error(scheme, controls)?;
        let flight = if controls.is_empty() {
            "even without controls the flight"
        } else {
            "the plan"
        };
        let order = f64::from(scheme.method.order().unwrap_or(1));
        let enough = self.steps as f64 * libm::pow(MARGIN * error / accuracy, order.recip());
        (error > accuracy).then(|| {
            format!(
                "{flight} in steps of {scheme} ends off the continuous motion under the same controls by {error:.1e} of the \
                 scene's size or rad, expected {accuracy:e} or less: about {:.0} `steps` would do",
                enough.ceil()
            )
        })
    }
}

/// Where a simulation ends with these loads on a body, one a step.
fn fly(
    mut simulation: Simulation,
    body: usize,
    controls: impl Iterator<Item = Load>,
) -> Option<Vec<BodyState>> {
    let mut loads = vec![Load::default(); simulation.states().len()];
    for control in controls {
        loads[body] = control;
        simulation.advance(&loads).ok()?;
    }
    Some(simulation.states().to_vec())
}
