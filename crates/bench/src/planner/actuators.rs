//! The planner beside CasADi's solvers on random maneuvers by one-sided thrusters, at least energy, at minimum fuel and in phases, and on
//! random turns by reaction wheels, at least energy and in the shortest time.

use std::path::Path;

use lgvi_control::{NewtonSettings, Start, TimeRange, Transfer, solve_minimum_time};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Load, Method, MethodError, RigidBody, Simulation, StepError, System};
use lgvi_truth::maneuvers::{Phased, Thrusted, Wheeled, phased, thrusted, wheeled};

use super::beside::{self, Drawn};
use super::peer::{ACTUATED, Commanded, Sphere, Stated};
use crate::error::BenchError;
use crate::peer::Python;

/// Tries the first `count` maneuvers of `seed` in so many steps of each kind; keeps `thrusters_<steps>.json`, `fuel_<steps>.json`,
/// `phases_<steps>.json`, `wheels_<steps>.json` and `fastest_<steps>.json`, and the tables of those names.
pub(crate) fn run(
    count: u64,
    seed: u64,
    intervals: usize,
    python: Option<&Python>,
    directory: &Path,
) -> Result<(), BenchError> {
    for (fuel, name) in [(false, "thrusters"), (true, "fuel")] {
        let draw = |index| thrusted(seed, 2 * index + u64::from(fuel), intervals);
        let tried = beside::try_all(count, python, &ACTUATED, draw)?;
        beside::keep((name, seed, intervals), &ACTUATED, tried, directory)?;
    }
    let draw = |index| phased(seed, index, intervals);
    let tried = beside::try_all(count, python, &ACTUATED, draw)?;
    beside::keep(("phases", seed, intervals), &ACTUATED, tried, directory)?;
    let draw = |index| wheeled(seed, index, intervals);
    let tried = beside::try_all(count, python, &ACTUATED, draw)?;
    beside::keep(("wheels", seed, intervals), &ACTUATED, tried, directory)?;
    let draw = |index| wheeled(seed, index, intervals).map(Fastest);
    let tried = beside::try_all(count, python, &ACTUATED, draw)?;
    beside::keep(("fastest", seed, intervals), &ACTUATED, tried, directory)
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

    fn begun(&self, _: f64) -> (&Transfer, Result<Simulation, MethodError>) {
        begun(&self.body, &self.transfer, self.transfer.h())
    }

    fn advance(&self, flight: &mut Simulation, commands: &[f64]) -> Result<(), StepError> {
        flight.set_thruster_commands(0, commands);
        flight.advance(&[Load::default()]).map(drop)
    }
}

/// The size of a sphere that contains all of a maneuver, in multiples of that of the middle phase.
const EVERYWHERE: f64 = 1e3;

impl Drawn for Phased {
    fn family(&self) -> &'static str {
        "phases"
    }

    fn ours(&self) -> Result<Transfer, BenchError> {
        self.whole.ours()
    }

    fn theirs(&self) -> Result<Stated<'_>, BenchError> {
        let Phased {
            whole,
            middle,
            sphere: (center, radius),
            off,
        } = self;
        // The states at which the middle phase begins and ends are in it.
        let holds = |end| (middle.start..=middle.end).contains(&end);
        let size = |end| if holds(end) { 1.0 } else { EVERYWHERE };
        let radii = (1..=whole.transfer.intervals()).map(|end| size(end) * radius);
        let sphere = Sphere {
            inside: true,
            center: *center,
            radii: radii.collect(),
        };
        Ok(whole.theirs()?.with_sphere(sphere).without(off, middle.end))
    }

    fn begun(&self, cost: f64) -> (&Transfer, Result<Simulation, MethodError>) {
        self.whole.begun(cost)
    }

    fn advance(&self, flight: &mut Simulation, commands: &[f64]) -> Result<(), StepError> {
        self.whole.advance(flight, commands)
    }
}

impl Drawn for Wheeled {
    fn family(&self) -> &'static str {
        "wheels"
    }

    fn ours(&self) -> Result<Transfer, BenchError> {
        Ok(self.transfer.clone())
    }

    fn theirs(&self) -> Result<Stated<'_>, BenchError> {
        stated(self, false)
    }

    fn begun(&self, _: f64) -> (&Transfer, Result<Simulation, MethodError>) {
        begun(&self.body, &self.transfer, self.transfer.h())
    }

    fn advance(&self, flight: &mut Simulation, commands: &[f64]) -> Result<(), StepError> {
        flight.set_wheel_commands(0, commands);
        flight.advance(&[Load::default()]).map(drop)
    }
}

/// A turn by reaction wheels that is to take the shortest time.
struct Fastest(Wheeled);

impl Drawn for Fastest {
    fn family(&self) -> &'static str {
        "fastest"
    }

    fn ours(&self) -> Result<Transfer, BenchError> {
        self.0.ours()
    }

    fn planned(&self, transfer: &Transfer) -> Result<f64, String> {
        let duration = transfer.h() * transfer.intervals() as f64;
        let range = TimeRange {
            shortest: 0.05 * duration,
            longest: 20.0 * duration,
            tolerance: TOLERANCE,
        };
        let settings = NewtonSettings::default();
        solve_minimum_time(transfer, &range, Start::Cold, &settings, |_| true)
            .map(|found| found.final_time)
            .map_err(|error| error.to_string())
    }

    fn theirs(&self) -> Result<Stated<'_>, BenchError> {
        stated(&self.0, true)
    }

    fn begun(&self, time: f64) -> (&Transfer, Result<Simulation, MethodError>) {
        let Wheeled { body, transfer, .. } = &self.0;
        begun(body, transfer, time / transfer.intervals() as f64)
    }

    fn advance(&self, flight: &mut Simulation, commands: &[f64]) -> Result<(), StepError> {
        self.0.advance(flight, commands)
    }
}

/// Relative tolerance of shortest times.
const TOLERANCE: f64 = 1e-4;

/// A turn by reaction wheels as it is stated to the peers.
fn stated(turn: &Wheeled, fastest: bool) -> Result<Stated<'_>, BenchError> {
    let weights = &turn.weights;
    let commanded = Commanded::Wheels { weights, fastest };
    Stated::of(&turn.body, 0.0, &turn.transfer, commanded)
}

/// A transfer, and its flight without gravity in steps of length `h`.
fn begun<'t>(
    body: &RigidBody,
    transfer: &'t Transfer,
    h: f64,
) -> (&'t Transfer, Result<Simulation, MethodError>) {
    let system = System::new(vec![body.clone()], Vec::new());
    let method = Method::Lgvi(Rotor::Discrete);
    let flight = Simulation::new(system, vec![*transfer.initial()], method, h);
    (transfer, flight)
}
