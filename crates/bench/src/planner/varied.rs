//! The planner beside CasADi's solvers on random maneuvers of many kinds, with inequalities.
//!
//! Each is stated to lgvi in units of its own, to the peers in units of its size: they depend on them, lgvi does not.

use std::path::Path;

use lgvi_control::miss;
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Load, Method, Simulation, System};
use lgvi_truth::maneuvers::{Varied, varied};

use super::beside::{self, Attempt, Peers, Tried};
use super::peer::{Commanded, Stated, VARIED};
use crate::error::BenchError;
use crate::peer::Python;

/// By how much a flight may miss the target, in units of the maneuver's size.
pub(super) const MISS: f64 = 1e-3;

/// Tries the first `count` maneuvers of `seed` in so many steps; keeps `varied_<steps>.json` and the table of that name.
pub(crate) fn run(
    count: u64,
    seed: u64,
    intervals: usize,
    python: Option<&Python>,
    directory: &Path,
) -> Result<(), BenchError> {
    let python = beside::with_casadi(python);
    let mut peers = python
        .map(|python| Peers::start(python, &VARIED))
        .transpose()?;
    let mut tried = Vec::new();
    for index in 0..count {
        let maneuver = varied(seed, index, intervals)?;
        let ours = Attempt::ours(&maneuver.stated()?);
        let peers = peers
            .as_mut()
            .map(|peers| solve(peers, &maneuver))
            .transpose()?;
        let one = Tried {
            index,
            family: maneuver.family.name(),
            ours,
            peers: peers.unwrap_or_default(),
        };
        one.print();
        tried.push(one);
    }
    beside::keep(("varied", seed, intervals), &VARIED, tried, directory)
}

/// An attempt of each of [`VARIED`].
fn solve(peers: &mut Peers<'_>, maneuver: &Varied) -> Result<Vec<Attempt>, BenchError> {
    let transfer = &maneuver.transfer;
    let Some(target) = transfer.target().state() else {
        return Err(BenchError::Body("a target that is no state".into()));
    };
    let stated = Stated {
        body: &maneuver.body,
        gm: maneuver.gm,
        h: transfer.h(),
        intervals: transfer.intervals(),
        commanded: Commanded::Loads {
            weights: maneuver.weights,
        },
        initial: transfer.initial(),
        target: &target,
        constraints: &maneuver.constraints,
    };
    peers.solve(&stated, |found| unflown(maneuver, &found.controls()))
}

/// Why a flight with these controls does not reach the target; nothing where it does. The equations of a step have more
/// solutions than the rotation: such as half a turn about a principal axis, which takes no moment.
fn unflown(maneuver: &Varied, controls: &[Load]) -> Option<String> {
    let transfer = &maneuver.transfer;
    let gravity = Central { gm: maneuver.gm };
    let system = System::new(vec![maneuver.body.clone()], vec![Box::new(gravity)]);
    let initial = vec![*transfer.initial()];
    let method = Method::LieEuler(Rotor::Discrete);
    let mut simulation = match Simulation::new(system, initial, method, transfer.h()) {
        Ok(simulation) => simulation,
        Err(error) => return Some(error.to_string()),
    };
    for control in controls {
        if let Err(error) = simulation.advance(&[*control]) {
            return Some(format!("cannot be flown: {error}"));
        }
    }
    let target = transfer.target().state()?;
    let missed = miss(&target, &simulation.states()[0]).norm();
    (missed > MISS).then(|| format!("misses the target by {missed:.1e} as flown"))
}
