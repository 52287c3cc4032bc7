//! The free asymmetric body in closed form: at any time at one price.

use std::path::Path;

use lgvi_dynamics::{Load, Method, Simulation};
use lgvi_truth::Case;

use crate::clock::nanoseconds;
use crate::error::BenchError;
use crate::peer::{Flyer, HEYOKA, Python};
use crate::spread::{Spread, short};
use crate::tables::Table;

const CASES: [&str; 2] = ["b1_free_asymmetric", "b2_dzhanibekov"];

/// The last time that the reference knows, and one that no stepping reaches.
const T: f64 = 1000.0;
const FAR: f64 = 1e9;

/// Tolerances of the peer.
const TOLERANCES: [f64; 2] = [1e-8, 1e-12];

pub(crate) fn run(
    python: Option<&Python>,
    repeats: u32,
    directory: &Path,
) -> Result<(), BenchError> {
    let python = python.filter(|python| python.has(HEYOKA));
    let mut flyer = python.map(|python| Flyer::new(python, HEYOKA));
    let mut head: Vec<_> = [
        "body",
        "closed form to t = 1000",
        "its attitude error",
        "to t = 1e9",
    ]
    .map(String::from)
    .into();
    if flyer.is_some() {
        let column = |tolerance| format!("heyoka to t = 1000, tolerance {tolerance:.0e}");
        head.extend(TOLERANCES.map(column));
    }
    let mut table = Table::new(head);
    for name in CASES {
        table.row(row(name, flyer.as_mut(), repeats)?);
    }
    table.keep(directory, "free")
}

fn row(name: &str, mut flyer: Option<&mut Flyer>, repeats: u32) -> Result<Vec<String>, BenchError> {
    let case = Case::load(name)?;
    let mut leaps = [leap(&case, T)?, leap(&case, FAR)?];
    let bodies = || leaps[0].system().bodies();
    let error = case.errors(T, bodies(), leaps[0].states())?.attitude;
    let mut errors = [f64::NAN; TOLERANCES.len()];
    let mut times = [Vec::new(), Vec::new()];
    let mut peer_times = [const { Vec::new() }; TOLERANCES.len()];
    if let Some(flyer) = &mut flyer {
        flyer.offer_case(name, &[T])?;
        for (tolerance, error) in TOLERANCES.iter().zip(&mut errors) {
            let flown = flyer.fly("Taylor", *tolerance)?.map_err(BenchError::Peer)?;
            if let Some(Some(states)) = flown.states(leaps[0].system()).first() {
                *error = case.errors(T, bodies(), states)?.attitude;
            }
        }
    }
    for _ in 0..repeats {
        for (times, leap) in times.iter_mut().zip(&mut leaps) {
            times.push(timed(leap)?);
        }
        let Some(flyer) = &mut flyer else { continue };
        for (tolerance, times) in TOLERANCES.iter().zip(&mut peer_times) {
            let seconds = flyer.time("Taylor", *tolerance)?;
            times.push(1e9 * seconds.map_err(BenchError::Peer)?);
        }
    }
    let time = |times: &Vec<f64>| {
        let spread = Spread::of(times.iter().copied());
        spread.map_or_else(String::new, |spread| format!("{} ns", short(spread.median)))
    };
    let mut cells = vec![
        name.replace('_', " "),
        time(&times[0]),
        format!("{error:.0e}"),
        time(&times[1]),
    ];
    if flyer.is_some() {
        for (peer, error) in peer_times.iter().zip(errors) {
            let ratio = Spread::of_ratios(peer, &times[0]);
            let ratio = ratio.map_or_else(String::new, |ratio| ratio.to_string());
            cells.push(format!("{ratio} times as long, error {error:.0e}"));
        }
    }
    Ok(cells)
}

/// One step to `t`, made.
fn leap(case: &Case, t: f64) -> Result<Simulation, BenchError> {
    let (system, states) = case.system()?;
    let mut simulation = Simulation::new(system, states, Method::ClosedForm, t)?;
    simulation.advance(&[Load::default()])?;
    Ok(simulation)
}

/// Time (ns) of such a step.
fn timed(simulation: &mut Simulation) -> Result<f64, BenchError> {
    let mut failed = None;
    let time = nanoseconds(1, || {
        if let Err(error) = simulation.advance(&[Load::default()]) {
            failed = Some(error);
        }
    });
    failed.map_or(Ok(time), |error| Err(error.into()))
}
