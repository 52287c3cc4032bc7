//! How many random maneuvers the planner solves from nothing, beside plain shooting.

use std::path::Path;

use lgvi_control::{NewtonSettings, Start, shooting, solve};
use lgvi_truth::maneuvers::{Class, Maneuver, maneuver};
use nalgebra::SVector;
use serde::Serialize;

use crate::clock::Moment;
use crate::error::BenchError;
use crate::tables::Table;

/// Terminal miss at which a maneuver counts as solved.
const SOLVED: f64 = 1e-11;

/// Costs that differ by less, relatively, are those of the same minimum.
const SAME: f64 = 1e-7;

const METHODS: [&str; 2] = ["Newton on all stages", "plain shooting from zero"];

/// What became of one attempt.
#[derive(Serialize)]
struct Attempt {
    index: u64,
    cost: Option<f64>,
    iterations: u32,
    milliseconds: f64,
    /// Why there is no plan.
    failure: Option<String>,
}

/// A method on one class of maneuvers.
#[derive(Serialize)]
struct Rate {
    method: &'static str,
    class: &'static str,
    tried: usize,
    solved: usize,
    percent: f64,
    /// Median and 95th percentile, of those solved.
    iterations: [f64; 2],
    milliseconds: [f64; 2],
    failures: Vec<Attempt>,
}

#[derive(Serialize)]
struct Report {
    seed: u64,
    count: u64,
    rates: Vec<Rate>,
    /// Maneuvers that both solve, and those where either finds the lower minimum.
    both: usize,
    newton_lower: usize,
    shooting_lower: usize,
}

/// Tries the first `count` maneuvers of each seed; prints rates and failures, keeps `maneuvers.json` and the table
/// `maneuvers`.
pub(crate) fn run(count: u64, seeds: &[u64], directory: &Path) -> Result<(), BenchError> {
    let reports = seeds.iter().map(|seed| report(count, *seed));
    let reports = reports.collect::<Result<Vec<_>, _>>()?;
    reports.iter().for_each(Report::print);
    table(&reports).keep(directory, "maneuvers")?;
    crate::error::write_json(&directory.join("maneuvers.json"), &reports)
}

/// How many each method solves, a column a class of a seed.
fn table(reports: &[Report]) -> Table {
    let all = || reports.iter().flat_map(|report| &report.rates);
    let classes = reports.iter().flat_map(|report| {
        let of_one = report.rates.iter().filter(|rate| rate.method == METHODS[0]);
        of_one.map(|rate| format!("seed {}: {}", report.seed, rate.class))
    });
    let mut table = Table::new(std::iter::once(String::new()).chain(classes));
    for method in METHODS {
        let rates = all().filter(|rate| rate.method == method);
        let cells = rates.map(|rate| format!("{} of {}", rate.solved, rate.tried));
        table.row(std::iter::once(method.to_owned()).chain(cells));
    }
    table
}

fn report(count: u64, seed: u64) -> Result<Report, BenchError> {
    let mut attempts = Vec::new();
    for index in 0..count {
        let maneuver = maneuver(seed, index)?;
        attempts.push((
            maneuver.class,
            newton(index, &maneuver),
            shoot(index, &maneuver),
        ));
    }
    let (mut both, mut newton_lower, mut shooting_lower) = (0, 0, 0);
    for (_, newton, shooting) in &attempts {
        if let (Some(newton), Some(shooting)) = (newton.cost, shooting.cost) {
            both += 1;
            newton_lower += usize::from(newton < shooting * (1.0 - SAME));
            shooting_lower += usize::from(shooting < newton * (1.0 - SAME));
        }
    }
    let mut methods = METHODS.map(|method| (method, Vec::new()));
    for (class, newton, shooting) in attempts {
        methods[0].1.push((class, newton));
        methods[1].1.push((class, shooting));
    }
    let mut rates = Vec::new();
    for (method, attempts) in methods {
        let (rest, orbit): (Vec<_>, Vec<_>) = attempts
            .into_iter()
            .partition(|(class, _)| *class == Class::RestToRest);
        for (class, attempts) in Class::ALL.into_iter().zip([rest, orbit]) {
            let attempts = attempts.into_iter().map(|(_, attempt)| attempt).collect();
            rates.push(rate(method, class, attempts));
        }
    }
    Ok(Report {
        seed,
        count,
        rates,
        both,
        newton_lower,
        shooting_lower,
    })
}

fn newton(index: u64, maneuver: &Maneuver) -> Attempt {
    let settings = NewtonSettings::default();
    let mut iterations = 0;
    let begun = Moment::now();
    let plan = solve(&maneuver.transfer, Start::Cold, &settings, |now| {
        iterations = now.iteration;
        true
    });
    let milliseconds = 1e3 * begun.elapsed();
    let (cost, failure) = match plan {
        Ok(plan) if plan.certificate.terminal <= SOLVED && plan.certificate.defect <= SOLVED => {
            (Some(plan.cost), None)
        }
        Ok(plan) => (None, Some(format!("not as flown: {:?}", plan.certificate))),
        Err(error) => (None, Some(error.to_string())),
    };
    Attempt {
        index,
        cost,
        iterations,
        milliseconds,
        failure,
    }
}

fn shoot(index: u64, maneuver: &Maneuver) -> Attempt {
    let settings = shooting::Settings {
        tolerance: SOLVED,
        ..shooting::Settings::default()
    };
    let mut iterations = 0;
    let begun = Moment::now();
    let solution = shooting::solve(&maneuver.transfer, SVector::zeros(), &settings, |now| {
        iterations = now.iteration;
        true
    });
    Attempt {
        index,
        iterations,
        milliseconds: 1e3 * begun.elapsed(),
        failure: solution.as_ref().err().map(ToString::to_string),
        cost: solution.ok().map(|solution| solution.extremal.cost),
    }
}

fn rate(method: &'static str, class: Class, attempts: Vec<Attempt>) -> Rate {
    let tried = attempts.len();
    let (failures, solved): (Vec<_>, Vec<_>) = attempts
        .into_iter()
        .partition(|attempt| attempt.failure.is_some());
    let spread = |value: fn(&Attempt) -> f64| {
        let mut values: Vec<_> = solved.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        [0.5, 0.95].map(|part| quantile(&values, part))
    };
    Rate {
        method,
        class: class.name(),
        tried,
        solved: solved.len(),
        percent: 100.0 * solved.len() as f64 / tried.max(1) as f64,
        iterations: spread(|attempt| f64::from(attempt.iterations)),
        milliseconds: spread(|attempt| attempt.milliseconds),
        failures,
    }
}

/// The value of `sorted` that this part of them does not exceed; not a number where there are none.
pub(crate) fn quantile(sorted: &[f64], part: f64) -> f64 {
    let index = (part * sorted.len() as f64).ceil() as usize;
    sorted
        .get(index.saturating_sub(1))
        .copied()
        .unwrap_or(f64::NAN)
}

impl Report {
    fn print(&self) {
        println!(
            "maneuvers 0 … {} of seed {}",
            self.count.saturating_sub(1),
            self.seed
        );
        let mut table = Table::new([
            "method",
            "class",
            "solved",
            "of",
            "%",
            "iterations, median and 95 %",
            "time (ms), median and 95 %",
        ]);
        for rate in &self.rates {
            let [[i, i95], [t, t95]] = [rate.iterations, rate.milliseconds];
            table.row([
                rate.method.to_owned(),
                rate.class.to_owned(),
                rate.solved.to_string(),
                rate.tried.to_string(),
                format!("{:.1}", rate.percent),
                format!("{i:.0}, {i95:.0}"),
                format!("{t:.2}, {t95:.2}"),
            ]);
        }
        table.print();
        println!(
            "both solve {}: Newton on all stages finds the lower minimum in {}, shooting in {}",
            self.both, self.newton_lower, self.shooting_lower
        );
        for rate in &self.rates {
            if rate.method == METHODS[1] {
                continue;
            }
            for Attempt {
                index,
                failure,
                iterations,
                ..
            } in &rate.failures
            {
                let failure = failure.as_deref().unwrap_or_default();
                println!(
                    "{}, {index}: {failure} ({iterations} iterations)",
                    rate.class
                );
            }
        }
    }
}
