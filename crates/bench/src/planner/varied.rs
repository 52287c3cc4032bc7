//! The planner beside CasADi's solvers on random maneuvers of many kinds, with inequalities, and on some that hold them with a probability.
//!
//! Those of many kinds are stated to lgvi in units of their own, to the peers in units of their size: they depend on them, lgvi does not.

use std::path::Path;

use lgvi_control::Transfer;
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Method, MethodError, Simulation, StepError, System};
use lgvi_truth::maneuvers::{Uncertain, Varied, uncertain, varied};

use super::beside::{self, Drawn};
use super::peer::{Commanded, Sphere, Stated, VARIED, load};
use crate::error::BenchError;
use crate::peer::Python;

/// Tries the first `count` maneuvers of `seed` in so many steps; keeps `varied_<steps>.json` and the table of that name, and those of
/// as many whose start deviates under `uncertain_<steps>`.
pub(crate) fn run(
    count: u64,
    seed: u64,
    intervals: usize,
    python: Option<&Python>,
    directory: &Path,
) -> Result<(), BenchError> {
    let draw = |index| varied(seed, index, intervals);
    let tried = beside::try_all(count, python, &VARIED, draw)?;
    beside::keep(("varied", seed, intervals), &VARIED, tried, directory)?;
    let draw = |index| uncertain(seed, index, intervals);
    let tried = beside::try_all(count, python, &VARIED, draw)?;
    beside::keep(("uncertain", seed, intervals), &VARIED, tried, directory)
}

impl Drawn for Varied {
    fn family(&self) -> &'static str {
        self.family.name()
    }

    fn ours(&self) -> Result<Transfer, BenchError> {
        Ok(self.stated()?)
    }

    fn theirs(&self) -> Result<Stated<'_>, BenchError> {
        let weights = self.weights;
        Stated::of(
            &self.body,
            self.gm,
            &self.transfer,
            Commanded::Loads { weights },
        )
        .map(|stated| stated.under(&self.constraints))
    }

    fn begun(&self, _: f64) -> (&Transfer, Result<Simulation, MethodError>) {
        let gravity = Central { gm: self.gm };
        let system = System::new(vec![self.body.clone()], vec![Box::new(gravity)]);
        let method = Method::LieEuler(Rotor::Discrete);
        let (initial, h) = (vec![*self.transfer.initial()], self.transfer.h());
        (&self.transfer, Simulation::new(system, initial, method, h))
    }

    fn advance(&self, flight: &mut Simulation, commands: &[f64]) -> Result<(), StepError> {
        flight.advance(&[load(commands)]).map(drop)
    }
}

/// To the peers the constraint is a sphere that grows as the deviations do.
impl Drawn for Uncertain {
    fn family(&self) -> &'static str {
        "uncertain"
    }

    fn ours(&self) -> Result<Transfer, BenchError> {
        Ok(self.transfer.clone())
    }

    fn theirs(&self) -> Result<Stated<'_>, BenchError> {
        let sphere = Sphere {
            inside: false,
            center: self.center,
            radii: self.radii.clone(),
        };
        Ok(self.certain.theirs()?.under(&[]).with_sphere(sphere))
    }

    fn begun(&self, cost: f64) -> (&Transfer, Result<Simulation, MethodError>) {
        self.certain.begun(cost)
    }

    fn advance(&self, flight: &mut Simulation, commands: &[f64]) -> Result<(), StepError> {
        self.certain.advance(flight, commands)
    }
}
