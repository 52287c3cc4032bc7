//! The planner beside CasADi's solvers on random maneuvers by one-sided thrusters, at least energy and at minimum fuel.

use std::path::Path;

use lgvi_control::Transfer;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Load, Method, MethodError, Simulation, StepError, System};
use lgvi_truth::maneuvers::{Thrusted, thrusted};

use super::beside::{self, Drawn};
use super::peer::{Commanded, Stated, THRUSTED};
use crate::error::BenchError;
use crate::peer::Python;

/// Tries the first `count` maneuvers of `seed` in so many steps of each cost; keeps `thrusters_<steps>.json` and `fuel_<steps>.json`,
/// and the tables of those names.
pub(crate) fn run(
    count: u64,
    seed: u64,
    intervals: usize,
    python: Option<&Python>,
    directory: &Path,
) -> Result<(), BenchError> {
    for (fuel, name) in [(false, "thrusters"), (true, "fuel")] {
        let draw = |index| thrusted(seed, 2 * index + u64::from(fuel), intervals);
        let tried = beside::try_all(count, python, &THRUSTED, draw)?;
        beside::keep((name, seed, intervals), &THRUSTED, tried, directory)?;
    }
    Ok(())
}

impl Drawn for Thrusted {
    fn family(&self) -> &'static str {
        if self.fuel { "fuel" } else { "thrusters" }
    }

    fn ours(&self) -> Result<Transfer, BenchError> {
        Ok(self.transfer.clone())
    }

    fn theirs(&self) -> Result<Stated<'_>, BenchError> {
        let (prices, fuel) = (&*self.prices, self.fuel);
        Stated::of(
            &self.body,
            0.0,
            &self.transfer,
            Commanded::Thrusters { prices, fuel },
        )
    }

    fn begun(&self) -> (&Transfer, Result<Simulation, MethodError>) {
        let system = System::new(vec![self.body.clone()], Vec::new());
        let method = Method::Lgvi(Rotor::Discrete);
        let (initial, h) = (vec![*self.transfer.initial()], self.transfer.h());
        (&self.transfer, Simulation::new(system, initial, method, h))
    }

    fn advance(&self, flight: &mut Simulation, commands: &[f64]) -> Result<(), StepError> {
        flight.set_thruster_commands(0, commands);
        flight.advance(&[Load::default()]).map(drop)
    }
}
