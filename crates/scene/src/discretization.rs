//! The discretization error of a maneuver: the distance of its steps from the continuous motion under the same
//! controls.

use std::iter::repeat_n;

use lgvi_dynamics::Accuracy;
use lgvi_dynamics::{BodyState, Load, Method, Simulation};

use crate::{Scene, Scheme};

/// Tolerance of the reference solution for the continuous motion, relative to the requested accuracy.
const REFERENCE: f64 = 1e-3;

/// Safety factor on the error in the estimate of the steps needed.
const MARGIN: f64 = 1.2;

/// Smallest tolerance of the reference solution.
const FINEST: f64 = 1e-14;

impl Scene {
    /// Returns the error at the end of a maneuver flown by `scheme`, with constant `controls` acting on its body in
    /// each step. The reference is the continuous motion under the same controls, and [`Accuracy`] defines the measure.
    /// If `controls` is empty, the result is the error of the free flight until the end of the run. Returns `None`
    /// without a maneuver, or if either of the two flights fails.
    pub fn discretization_error(&self, scheme: Scheme, controls: &[Load]) -> Option<f64> {
        let body = self.maneuver.as_ref()?.body;
        let start: Vec<_> = self.bodies.iter().map(|named| named.state).collect();
        let tolerance = REFERENCE * self.accuracy.unwrap_or(f64::EPSILON);
        let reference = Method::DormandPrince853 {
            tolerance: tolerance.max(FINEST),
        };
        // The continuous motion is that of bodies that do not dock.
        let apart = Self {
            docking: Vec::new(),
            ..self.clone()
        };
        let flown = apart.simulation_from(start.clone(), scheme).ok()?;
        let simulate = |h| Simulation::new(self.system(), start.clone(), reference, h).ok();
        let (flown, truth) = if controls.is_empty() {
            let free = |steps| repeat_n(Load::default(), steps);
            // In one step of the run, so that the reference method chooses its step sizes freely.
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

    /// Returns a warning if a maneuver's steps deviate from the continuous motion by more than the accuracy asked of
    /// `auto`.
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

/// Returns the final states of a simulation under these loads on one body, one load per step.
fn fly(
    mut simulation: Simulation,
    body: usize,
    controls: impl Iterator<Item = Load>,
) -> Option<Vec<BodyState>> {
    let mut loads = vec![Load::default(); simulation.states().len()];
    for control in controls {
        loads[body] = simulation.command(body, control);
        simulation.advance(&loads).ok()?;
    }
    Some(simulation.states().to_vec())
}
