//! The solver's time against the number of steps, plain shooting beside it.

use std::path::Path;

use lgvi_control::Start;
use serde::Serialize;

use super::Options;
use super::case::Case;
use super::ours::{self, Iterations};
use super::sample::Sample;
use crate::error::BenchError;
use crate::picture::{Axis, Curve, Picture};

const STEPS: [usize; 7] = [100, 316, 1_000, 3_162, 10_000, 31_623, 100_000];
const QUICK: [usize; 3] = [100, 316, 1_000];

/// Problems below this size are left out of the slope: their time is that of the coarse solve before.
const ASYMPTOTIC: usize = 1_000;

/// Seconds after which a time is not taken again.
const PATIENCE: f64 = 5.0;

/// One maneuver in growing numbers of steps.
#[derive(Serialize)]
pub(crate) struct Scaling {
    scene: String,
    points: Vec<Point>,
    /// `p` of time ∝ Nᵖ.
    exponent: f64,
}

/// In one number of steps.
#[derive(Serialize)]
struct Point {
    steps: usize,
    /// CPU time of a cold solve (s).
    seconds: Sample,
    /// Median CPU time of one iteration at all steps, per step (s).
    iteration_seconds_per_step: f64,
    iterations: Iterations,
    cost: f64,
    /// By how much the propagator's flight misses the target.
    violation: f64,
    /// CPU time of plain shooting (s) and its iterations, where it converges.
    shooting: Option<(f64, u32)>,
}

/// Measures, prints and draws all maneuvers.
pub(crate) fn run(
    cases: &[Case],
    options: &Options,
    repeats: u32,
    images: &Path,
) -> Result<Vec<Scaling>, BenchError> {
    let steps = options.steps(&STEPS, &QUICK);
    let mut all = Vec::new();
    let mut curves = Vec::new();
    for case in cases {
        let points = steps
            .iter()
            .map(|&steps| point(&case.with_steps(steps), repeats));
        let points = points.collect::<Result<Vec<_>, _>>()?;
        let scaling = Scaling {
            scene: case.name().into(),
            exponent: exponent(&points),
            points,
        };
        scaling.print();
        curves.extend(scaling.curves());
        all.push(scaling);
    }
    let picture = Picture {
        title: "time of a plan against its number of steps".into(),
        horizontal: Axis::logarithmic("steps N"),
        vertical: Axis::logarithmic("CPU time (s)"),
    };
    picture.draw(&images.join("planner_scaling.svg"), &curves)?;
    Ok(all)
}

fn point(case: &Case, repeats: u32) -> Result<Point, BenchError> {
    let transfer = case.transfer()?;
    let mut times = Vec::new();
    let mut iteration = Vec::new();
    let first = ours::newton(&transfer, Start::Cold)?;
    for _ in 0..repeats {
        let solved = ours::newton(&transfer, Start::Cold)?;
        times.push(solved.seconds);
        iteration.push(solved.iteration_seconds);
        if times.iter().sum::<f64>() > PATIENCE {
            break;
        }
    }
    let steps = case.scene.steps as usize;
    let shooting = ours::shot(&transfer).ok();
    Ok(Point {
        steps,
        seconds: Sample::of(&times),
        iteration_seconds_per_step: Sample::of(&iteration).median / steps as f64,
        iterations: first.iterations,
        cost: first.plan.cost,
        violation: case.violation(&first.plan.controls)?,
        shooting: shooting.map(|shot| (shot.seconds, shot.iterations)),
    })
}

/// The slope of the least squares line through the logarithms.
fn exponent(points: &[Point]) -> f64 {
    let logarithms: Vec<_> = points
        .iter()
        .filter(|point| point.steps >= ASYMPTOTIC)
        .map(|point| [(point.steps as f64).ln(), point.seconds.median.ln()])
        .collect();
    let count = logarithms.len() as f64;
    let mean = |which: usize| logarithms.iter().map(|point| point[which]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let moment = |which: usize, center: f64| {
        let products = logarithms
            .iter()
            .map(|point| (point[0] - x) * (point[which] - center));
        products.sum::<f64>()
    };
    moment(1, y) / moment(0, x)
}

impl Scaling {
    fn print(&self) {
        println!("\n{}: time of a cold plan against its steps", self.scene);
        println!(
            "| N | time (ms) | range (ms) | iterations | an iteration, a step (µs) | violation as flown | plain shooting (ms) |"
        );
        println!("|---|---|---|---|---|---|---|");
        for point in &self.points {
            let shooting = point.shooting.map_or_else(
                || "no solution".into(),
                |(seconds, iterations)| format!("{:.2} ({iterations})", 1e3 * seconds),
            );
            println!(
                "| {} | {:.2} | {:.2}–{:.2} | {} coarse + {} | {:.2} | {:.0e} | {shooting} |",
                point.steps,
                1e3 * point.seconds.median,
                1e3 * point.seconds.least,
                1e3 * point.seconds.most,
                point.iterations.coarse,
                point.iterations.fine,
                1e6 * point.iteration_seconds_per_step,
                point.violation,
            );
        }
        if self.exponent.is_finite() {
            println!("time ∝ N^{:.2} from N = {ASYMPTOTIC}", self.exponent);
        }
    }

    fn curves(&self) -> [Curve; 2] {
        let curve = |label: &str, points: Vec<[f64; 2]>| Curve {
            label: format!("{}, {label}", self.scene.replace('_', " ")),
            points,
        };
        let newton = self.points.iter();
        let newton = newton.map(|point| [point.steps as f64, point.seconds.median]);
        let shooting = self.points.iter();
        let shooting = shooting.filter_map(|point| Some([point.steps as f64, point.shooting?.0]));
        [
            curve("Newton", newton.collect()),
            curve("shooting", shooting.collect()),
        ]
    }
}
