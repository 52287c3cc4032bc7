//! The solvers of `lgvi_control`, timed.

use lgvi_control::{NewtonSettings, Phase, Plan, Progress, Start, Transfer, shooting};
use lgvi_dynamics::Load;
use nalgebra::SVector;

use crate::clock::Moment;
use crate::error::BenchError;

/// A solution and what it took.
pub(crate) struct Solved {
    pub seconds: f64,
    pub iterations: Iterations,
    /// Seconds of an iteration at all steps; not a number with fewer than two.
    pub iteration_seconds: f64,
    pub plan: Plan,
}

/// Newton iterations of the structured solver.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub(crate) struct Iterations {
    /// At fewer steps than asked for.
    pub coarse: u32,
    /// At all steps.
    pub fine: u32,
}

/// Of a solver that knows no fewer steps.
impl From<u32> for Iterations {
    fn from(fine: u32) -> Self {
        Self { coarse: 0, fine }
    }
}

/// By the structured solver.
pub(crate) fn newton(transfer: &Transfer, start: Start<'_>) -> Result<Solved, BenchError> {
    let begun = Moment::now();
    let mut iterations = Iterations::default();
    let mut before = 0;
    let mut fine: Option<[f64; 2]> = None;
    let observe = |now: &Progress| {
        let made = now.iteration.saturating_sub(before);
        before = now.iteration;
        match now.phase {
            Phase::Fine => {
                let at = begun.elapsed();
                let from = fine.map_or(at, |fine| fine[0]);
                iterations.fine += if fine.is_some() { made } else { 0 };
                fine = Some([from, at]);
            }
            _ => iterations.coarse += made,
        }
        true
    };
    let plan = lgvi_control::solve(transfer, start, &NewtonSettings::default(), observe)
        .map_err(|error| BenchError::Plan(error.to_string()))?;
    let seconds = begun.elapsed();
    let [from, to] = fine.unwrap_or_default();
    Ok(Solved {
        seconds,
        iterations,
        iteration_seconds: (to - from) / f64::from(iterations.fine),
        plan,
    })
}

/// A solution by plain shooting and what it took.
pub(crate) struct Shot {
    pub seconds: f64,
    pub iterations: u32,
    pub cost: f64,
    pub controls: Vec<Load>,
}

/// By plain shooting from the free drift.
pub(crate) fn shot(transfer: &Transfer) -> Result<Shot, BenchError> {
    let begun = Moment::now();
    let found = shooting::solve(
        transfer,
        SVector::zeros(),
        &shooting::Settings::default(),
        |_| true,
    )
    .map_err(|error| BenchError::Plan(error.to_string()))?;
    Ok(Shot {
        seconds: begun.elapsed(),
        iterations: found.last.iteration,
        cost: found.extremal.cost,
        controls: found.extremal.controls,
    })
}
