//! Plans from the plan before, against plans from nothing: from a start that is somewhat elsewhere, and in flight.

use lgvi_control::{Plan, Start, TooLate};
use lgvi_dynamics::BodyState;
use lgvi_lie::exp;
use nalgebra::Vector3;
use serde::Serialize;

use super::Options;
use super::case::Case;
use super::ours::{self, Solved};
use super::sample::Sample;
use crate::error::BenchError;
use crate::spread::Spread;

const STEPS: [usize; 2] = [100, 1000];
const QUICK: [usize; 1] = [100];

/// Starts that are tried.
const TRIALS: usize = 10;

/// Seed of the starts.
const SEED: u64 = 20_261_121;

/// By what part of itself each quantity of the start differs; attitudes by as much of a radian.
const APART: f64 = 0.01;

/// What part of the plan is flown before a plan in flight, and what its state then misses of what was planned.
const FLOWN: f64 = 0.1;
const MISSED: f64 = 0.001;

/// Warm against cold plans of one maneuver, over the starts.
#[derive(Serialize)]
pub(crate) struct Replan {
    scene: String,
    steps: usize,
    /// What the plan before is of.
    situation: &'static str,
    cold_seconds: Sample,
    warm_seconds: Sample,
    /// Warm in parts of cold, start by start and repetition by repetition.
    ratio: Option<Spread>,
    cold_iterations: Sample,
    warm_iterations: Sample,
    /// Largest relative difference of warm and cold costs.
    cost_difference: f64,
    /// Largest miss of the target when warm plans are flown.
    violation: f64,
}

/// Measures and prints all situations.
pub(crate) fn run(
    cases: &[Case],
    options: &Options,
    repeats: u32,
) -> Result<Vec<Replan>, BenchError> {
    println!(
        "\n| plan again | N | cold (ms) | warm (ms) | warm / cold | iterations cold, warm | cost difference | violation as flown |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let steps = options.steps(&STEPS, &QUICK);
    let mut all = Vec::new();
    for case in cases {
        for &steps in &steps {
            let case = case.with_steps(steps);
            let plan = ours::newton(&case.transfer()?, Start::Cold)?.plan;
            for (situation, flown, apart) in [
                ("start 1 % apart", 0, APART),
                ("in flight", (FLOWN * steps as f64) as usize, MISSED),
            ] {
                let replan = replan(&case, &plan, situation, flown, apart, repeats)?;
                replan.print();
                all.push(replan);
            }
        }
    }
    Ok(all)
}

fn replan(
    case: &Case,
    plan: &Plan,
    situation: &'static str,
    flown: usize,
    apart: f64,
    repeats: u32,
) -> Result<Replan, BenchError> {
    let mut random = fastrand::Rng::with_seed(SEED);
    let whole = case.transfer()?;
    let too_late = |error: TooLate| BenchError::Plan(error.to_string());
    let rest = plan.remaining(&whole, flown).map_err(too_late)?;
    let mut times = [Vec::new(), Vec::new()];
    let mut iterations = [Vec::new(), Vec::new()];
    let (mut cost_difference, mut violation) = (0.0_f64, 0.0_f64);
    for _ in 0..TRIALS {
        let start = displaced(&rest.states[0], apart, &mut random);
        let case = case.remaining(rest.commands.len(), start)?;
        let transfer = whole.remaining(flown, start).map_err(too_late)?;
        let solve = |warm: usize| ours::newton(&transfer, [Start::Cold, Start::Warm(&rest)][warm]);
        let mut costs = [0.0; 2];
        for repeat in 0..repeats {
            for warm in 0..2 {
                let Solved {
                    seconds,
                    iterations: made,
                    plan,
                    ..
                } = solve(warm)?;
                if repeat == 0 {
                    iterations[warm].push(f64::from(made.coarse + made.fine));
                    costs[warm] = plan.cost;
                    if warm == 1 {
                        violation = violation.max(case.violation(&plan.controls)?);
                    }
                }
                times[warm].push(seconds);
            }
        }
        cost_difference = cost_difference.max((costs[1] / costs[0] - 1.0).abs());
    }
    let ratio = Spread::of_ratios(&times[1], &times[0]);
    let [cold_seconds, warm_seconds] = times.map(|times| Sample::of(&times));
    let [cold_iterations, warm_iterations] = iterations.map(|made| Sample::of(&made));
    Ok(Replan {
        scene: case.name().into(),
        steps: rest.commands.len(),
        situation,
        cold_seconds,
        warm_seconds,
        ratio,
        cold_iterations,
        warm_iterations,
        cost_difference,
        violation,
    })
}

/// A state near the given one.
fn displaced(state: &BodyState, apart: f64, random: &mut fastrand::Rng) -> BodyState {
    let mut shift = |size: f64| {
        let direction = Vector3::from_fn(|_, _| 2.0 * random.f64() - 1.0);
        apart * size * direction
    };
    BodyState {
        position: state.position + shift(state.position.norm()),
        linear_momentum: state.linear_momentum + shift(state.linear_momentum.norm()),
        attitude: state.attitude * exp(&shift(1.0)),
        angular_momentum: state.angular_momentum + shift(state.angular_momentum.norm()),
    }
}

impl Replan {
    fn print(&self) {
        println!(
            "| {}, {} | {} | {:.2} | {:.2} | {} | {}, {} | {:.0e} | {:.0e} |",
            self.scene,
            self.situation,
            self.steps,
            1e3 * self.cold_seconds.median,
            1e3 * self.warm_seconds.median,
            self.ratio
                .map_or_else(String::new, |ratio| ratio.to_string()),
            self.cold_iterations.median,
            self.warm_iterations.median,
            self.cost_difference,
            self.violation
        );
    }
}
