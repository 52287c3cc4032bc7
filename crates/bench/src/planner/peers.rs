//! The solver beside CasADi's on the same discrete problem from the same guess, in turns.

use serde::Serialize;

use super::Options;
use super::case::Case;
use super::ours::{self, Iterations};
use super::peer::{Casadi, Commanded, SOLVERS, Stated};
use super::sample::Sample;
use crate::error::BenchError;
use crate::peer::{CASADI, Python};
use crate::spread::{Spread, short};
use crate::tables::Table;
use lgvi_control::Start;

const STEPS: [usize; 3] = [100, 500, 1000];
const QUICK: [usize; 1] = [100];

/// One maneuver in one number of steps.
#[derive(Serialize)]
pub(crate) struct Comparison {
    scene: String,
    steps: usize,
    /// The structured solver, plain shooting, then the peers.
    solvers: Vec<Row>,
}

/// What one solver did.
#[derive(Serialize)]
struct Row {
    solver: &'static str,
    /// CPU time of a solve (s).
    seconds: Sample,
    /// Wall time of a solve (s), of peers.
    wall: Option<Sample>,
    /// Time to build, generate and compile the problem (s), of peers; problems after the first share what is compiled.
    build_seconds: Option<f64>,
    /// Time in parts of the structured solver's, repetition by repetition.
    ratio: Option<Spread>,
    /// Iterations at all steps.
    iterations: u32,
    /// Iterations at fewer steps.
    coarse_iterations: u32,
    cost: f64,
    /// Relative difference of the cost from the structured solver's.
    cost_difference: f64,
    /// By how much the propagator's flight misses the target.
    violation: f64,
    /// What the solver says of itself where it has not converged.
    failure: Option<String>,
}

/// Measures and prints all comparisons, up to one that fails.
pub(crate) fn run(
    cases: &[Case],
    options: &Options,
    python: Option<&Python>,
    repeats: u32,
    all: &mut Vec<Comparison>,
) -> Result<(), BenchError> {
    let steps = options.steps(&STEPS, &QUICK);
    for case in cases {
        for &steps in &steps {
            let compared = compare(&case.with_steps(steps), python, repeats)?;
            compared.print();
            all.push(compared);
        }
    }
    Ok(())
}

fn compare(case: &Case, python: Option<&Python>, repeats: u32) -> Result<Comparison, BenchError> {
    let transfer = case.transfer()?;
    let mut newton = Row::named("structured Newton");
    let mut shooting = Row::named("plain shooting");
    let mut rows: Vec<_> = SOLVERS
        .iter()
        .map(|solver| Row::named(solver.label))
        .collect();
    let python = python.filter(|python| python.has(CASADI));
    let mut casadi = python.map(Casadi::start).transpose()?;
    match &mut casadi {
        None => rows.clear(),
        Some(casadi) => {
            for (row, seconds) in rows.iter_mut().zip(build(casadi, case)?) {
                row.build_seconds = Some(seconds);
            }
        }
    }
    let mut times = vec![Vec::new(); 2 + rows.len()];
    let mut walls = vec![Vec::new(); rows.len()];
    // the first round warms up, and says what is found
    for round in 0..=repeats {
        let warm = round > 0;
        let solved = ours::newton(&transfer, Start::Cold)?;
        let shot = ours::shot(&transfer);
        if warm {
            times[0].push(solved.seconds);
            times[1].extend(shot.as_ref().map(|shot| shot.seconds));
        } else {
            newton.tell(solved.iterations, solved.plan.cost);
            newton.violation = case.violation(&solved.plan.controls)?;
            match shot {
                Ok(shot) => {
                    shooting.tell(shot.iterations.into(), shot.cost);
                    shooting.violation = case.violation(&shot.controls)?;
                }
                Err(error) => shooting.failure = Some(error.to_string()),
            }
        }
        let Some(casadi) = &mut casadi else { continue };
        for (index, row) in rows.iter_mut().enumerate() {
            let found = casadi.solve(index, !warm)?;
            if warm {
                times[2 + index].push(found.seconds);
                walls[index].push(found.wall);
            } else {
                row.tell(found.iterations.into(), found.cost);
                row.violation = case.violation(&found.controls()).unwrap_or(f64::NAN);
            }
            if !found.success {
                row.failure = Some(found.status);
            }
        }
    }
    for (row, walls) in rows.iter_mut().zip(&walls) {
        row.wall = Some(Sample::of(walls));
    }
    let mut solvers = vec![newton, shooting];
    solvers.extend(rows);
    for (row, times) in solvers.iter_mut().zip(&times) {
        row.seconds = Sample::of(times);
    }
    let cost = solvers[0].cost;
    for (row, seconds) in solvers.iter_mut().zip(&times) {
        row.ratio = Spread::of_ratios(seconds, &times[0]);
        row.cost_difference = row.cost / cost - 1.0;
    }
    Ok(Comparison {
        scene: case.name().into(),
        steps: case.scene.steps as usize,
        solvers,
    })
}

/// States a scene's problem to all solvers.
fn build(casadi: &mut Casadi, case: &Case) -> Result<Vec<f64>, BenchError> {
    let (named, maneuver, target) = (case.body()?, case.maneuver()?, case.target()?);
    let weight = maneuver.actuation.weight();
    let stated = Stated {
        body: &named.body,
        gm: case.attractor()?.gm,
        h: case.scene.h(),
        intervals: case.scene.steps as usize,
        commanded: Commanded::Loads {
            weights: [0, 3].map(|first| weight.fixed_view::<3, 3>(first, first).into_owned()),
        },
        initial: &named.state,
        target,
        constraints: &[],
        sphere: None,
        off: (&[], 0),
    };
    casadi.build(&stated, &SOLVERS)
}

/// Times in parts of the structured solver's at the largest number of steps, a column a scene.
pub(crate) fn table(comparisons: &[Comparison]) -> Option<Table> {
    let largest = comparisons.iter().map(|compared| compared.steps).max()?;
    let at = |compared: &&Comparison| compared.steps == largest;
    let columns: Vec<_> = comparisons.iter().filter(at).collect();
    let head = format!("CPU time in parts of the structured Newton method's, N = {largest}");
    let scenes = columns
        .iter()
        .map(|compared| compared.scene.replace('_', " "));
    let mut table = Table::new(std::iter::once(head).chain(scenes));
    for (index, row) in columns.first()?.solvers.iter().enumerate() {
        let cells = columns.iter().map(|compared| {
            let row = &compared.solvers[index];
            match row.ratio {
                Some(_) if index == 0 => format!("1 ({} ms)", short(1e3 * row.seconds.median)),
                _ => row.told(),
            }
        });
        table.row(std::iter::once(row.solver.to_owned()).chain(cells));
    }
    Some(table)
}

impl Row {
    fn named(solver: &'static str) -> Self {
        Self {
            solver,
            seconds: Sample::of(&[]),
            wall: None,
            build_seconds: None,
            ratio: None,
            iterations: 0,
            coarse_iterations: 0,
            cost: f64::NAN,
            cost_difference: f64::NAN,
            violation: f64::NAN,
            failure: None,
        }
    }

    /// The ratio, marked where the solver has not converged.
    fn told(&self) -> String {
        match (self.ratio, &self.failure) {
            (Some(ratio), None) => ratio.to_string(),
            (Some(ratio), Some(_)) => format!("not converged, {ratio}"),
            (None, failure) => failure.clone().unwrap_or_default(),
        }
    }

    fn tell(&mut self, iterations: Iterations, cost: f64) {
        self.iterations = iterations.fine;
        self.coarse_iterations = iterations.coarse;
        self.cost = cost;
    }
}

impl Comparison {
    fn print(&self) {
        println!("\n{}, N = {}", self.scene, self.steps);
        println!(
            "| solver | time (ms) | range (ms) | ratio | iterations | cost | difference | violation as flown | build (s) |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
        for row in &self.solvers {
            let Sample {
                median,
                least,
                most,
            } = row.seconds;
            let coarse = match row.coarse_iterations {
                0 => String::new(),
                coarse => format!("{coarse} coarse + "),
            };
            println!(
                "| {} | {:.3} | {:.3}–{:.3} | {} | {coarse}{} | {:.12} | {:.0e} | {:.0e} | {} |",
                row.solver,
                1e3 * median,
                1e3 * least,
                1e3 * most,
                row.told(),
                row.iterations,
                row.cost,
                row.cost_difference,
                row.violation,
                row.build_seconds
                    .map_or_else(String::new, |seconds| format!("{seconds:.1}"))
            );
            if let Some(failure) = &row.failure {
                println!("{}: {failure}", row.solver);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Row;
    use crate::spread::Spread;

    #[test]
    fn the_ratio_of_a_solver_that_has_not_converged_is_marked() {
        let mut row = Row::named("solver");
        row.ratio = Spread::of([2.0]);
        assert_eq!(row.told(), "2.00 (2.00–2.00)");
        row.failure = Some("Maximum_Iterations_Exceeded".into());
        assert_eq!(row.told(), "not converged, 2.00 (2.00–2.00)");
        row.ratio = None;
        assert_eq!(row.told(), "Maximum_Iterations_Exceeded");
    }
}
