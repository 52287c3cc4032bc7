//! One flight of a reference case, timed.

use std::time::Instant;

use lgvi_dynamics::{BodyState, Load, Method, Simulation, System};
use lgvi_truth::{Case, Errors};

use crate::error::BenchError;

/// What a flight took and how far off it ended.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flown {
    pub seconds: f64,
    pub errors: Errors,
}

/// Flies to the reference state at `t` in `steps` steps, as often as told; the fastest counts.
pub(crate) fn fly(
    case: &Case,
    t: f64,
    method: Method,
    steps: u64,
    repeats: u32,
) -> Result<Flown, BenchError> {
    let mut best = f64::INFINITY;
    let mut errors = Errors::default();
    for _ in 0..repeats {
        let (system, states) = case.system()?;
        let controls = vec![Load::default(); states.len()];
        let mut simulation = Simulation::new(system, states, method, t / steps as f64)?;
        let start = Instant::now();
        for _ in 0..steps {
            simulation.advance(&controls)?;
        }
        best = best.min(start.elapsed().as_secs_f64());
        errors = case.errors(t, simulation.system().bodies(), simulation.states())?;
    }
    Ok(Flown {
        seconds: best,
        errors,
    })
}

/// Time of one step of length `t`, the fastest of several.
pub(crate) fn time_to(
    system: System,
    states: Vec<BodyState>,
    method: Method,
    t: f64,
    repeats: u32,
) -> Result<f64, BenchError> {
    let controls = vec![Load::default(); states.len()];
    let mut simulation = Simulation::new(system, states, method, t)?;
    let mut best = f64::INFINITY;
    for _ in 0..repeats {
        let start = Instant::now();
        simulation.advance(&controls)?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok(best)
}
