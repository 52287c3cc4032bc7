//! The planner beside CasADi's solvers on random maneuvers by one-sided thrusters, at least energy and at minimum fuel.

use std::path::Path;

use lgvi_control::miss;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Load, Method, Simulation, System};
use lgvi_truth::maneuvers::{Thrusted, thrusted};

use super::beside::{self, Attempt, Peers, Tried};
use super::peer::{Commanded, Stated, THRUSTED};
use super::varied::MISS;
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
    let python = beside::with_casadi(python);
    let mut peers = python
        .map(|python| Peers::start(python, &THRUSTED))
        .transpose()?;
    let mut tried = [Vec::new(), Vec::new()];
    for index in 0..2 * count {
        let maneuver = thrusted(seed, index, intervals)?;
        let ours = Attempt::ours(&maneuver.transfer);
        let peers = peers
            .as_mut()
            .map(|peers| solve(peers, &maneuver))
            .transpose()?;
        let one = Tried {
            index,
            family: if maneuver.fuel { "fuel" } else { "thrusters" },
            ours,
            peers: peers.unwrap_or_default(),
        };
        one.print();
        tried[usize::from(maneuver.fuel)].push(one);
    }
    let [energy, fuel] = tried;
    beside::keep(("thrusters", seed, intervals), &THRUSTED, energy, directory)?;
    beside::keep(("fuel", seed, intervals), &THRUSTED, fuel, directory)
}

/// An attempt of each of [`THRUSTED`].
fn solve(peers: &mut Peers<'_>, maneuver: &Thrusted) -> Result<Vec<Attempt>, BenchError> {
    let transfer = &maneuver.transfer;
    let Some(target) = transfer.target().state() else {
        return Err(BenchError::Body("a target that is no state".into()));
    };
    let stated = Stated {
        body: &maneuver.body,
        gm: 0.0,
        h: transfer.h(),
        intervals: transfer.intervals(),
        commanded: Commanded::Thrusters {
            prices: &maneuver.prices,
            fuel: maneuver.fuel,
        },
        initial: transfer.initial(),
        target: &target,
        constraints: &[],
    };
    peers.solve(&stated, |found| unflown(maneuver, &found.controls))
}

/// Why a flight with these thrusts does not reach the target; nothing where it does.
fn unflown(maneuver: &Thrusted, thrusts: &[Vec<f64>]) -> Option<String> {
    let transfer = &maneuver.transfer;
    let system = System::new(vec![maneuver.body.clone()], Vec::new());
    let method = Method::Lgvi(Rotor::Discrete);
    let initial = vec![*transfer.initial()];
    let mut simulation = match Simulation::new(system, initial, method, transfer.h()) {
        Ok(simulation) => simulation,
        Err(error) => return Some(error.to_string()),
    };
    for thrust in thrusts {
        simulation.set_thruster_commands(0, thrust);
        if let Err(error) = simulation.advance(&[Load::default()]) {
            return Some(format!("cannot be flown: {error}"));
        }
    }
    let target = transfer.target().state()?;
    let missed = miss(&target, &simulation.states()[0]).norm();
    (missed > MISS).then(|| format!("misses the target by {missed:.1e} as flown"))
}
