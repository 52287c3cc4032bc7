//! How the time of the chosen run compares with that of the best choice by hand; run in release, ignored otherwise.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use lgvi_dynamics::Load;
use lgvi_dynamics::Method;

use super::{Flown, RUNS, TOLERANCES};

/// How many times a flight, or a part of it, is timed; the least time counts.
const REPEATS: usize = 9;

/// What a part of a flight takes that is timed.
const PART: Duration = Duration::from_millis(2);

/// The time (s) of a run, from the fastest of several flights of its first part.
pub fn time(flown: &Flown, method: Method, substeps: u32) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..REPEATS {
        let mut simulation = flown.simulation(method, substeps);
        let controls = vec![Load::default(); simulation.states().len()];
        let begun = Instant::now();
        let mut steps = 0;
        while steps < flown.run.steps && (steps == 0 || begun.elapsed() < PART) {
            for _ in 0..(flown.run.steps - steps).min(8) {
                simulation.advance(&controls).expect("a step");
                steps += 1;
            }
        }
        let seconds = begun.elapsed().as_secs_f64();
        least = least.min(seconds * flown.run.steps as f64 / steps as f64);
    }
    least
}

/// The methods to try by hand.
fn methods() -> Vec<Method> {
    let rotor = lgvi_dynamics::integrator::Rotor::default();
    let mut methods = vec![Method::Lgvi(rotor)];
    methods.extend([4, 6, 8, 10].map(|order| Method::Composition { order, rotor }));
    methods
}

#[test]
#[ignore = "a measurement, for release builds"]
fn auto_against_the_best_choice_by_hand() {
    println!(
        "{:<26} {:>6} {:>6} {:>7} {:<26} {:>5} {:>8} {:>9} {:<26} {:>5} {:>9} {:>6} {:>9} {:>7}",
        "case",
        "T",
        "steps",
        "asked",
        "chosen",
        "sub",
        "error",
        "s",
        "best by hand",
        "sub",
        "s",
        "ratio",
        "pilot s",
        "evals"
    );
    let mut worst = 0.0_f64;
    for (name, duration, steps) in RUNS {
        let flown = Flown::new(name, duration, steps);
        let mut known: BTreeMap<(String, u32), f64> = BTreeMap::new();
        let mut best: Vec<Option<(Method, u32, f64)>> = vec![None; TOLERANCES.len()];
        for method in methods() {
            let mut grid = 1.0_f64;
            let mut last = 0;
            let mut next = 0;
            while next < TOLERANCES.len() && grid * (steps as f64) < 3e6 {
                let substeps = grid.round() as u32;
                grid *= 2_f64.powf(0.25);
                if substeps == last {
                    continue;
                }
                last = substeps;
                let error = flown.error(method, substeps);
                known.insert((format!("{method:?}"), substeps), error);
                let mut seconds = None;
                while next < TOLERANCES.len() && error <= TOLERANCES[next] {
                    let seconds = *seconds.get_or_insert_with(|| time(&flown, method, substeps));
                    if best[next].is_none_or(|(_, _, least)| seconds < least) {
                        best[next] = Some((method, substeps, seconds));
                    }
                    next += 1;
                }
            }
        }
        for (tolerance, best) in TOLERANCES.into_iter().zip(best) {
            let begun = Instant::now();
            let choice = flown.choose(tolerance).expect("a choice");
            let pilot = begun.elapsed().as_secs_f64();
            let (method, substeps) = (choice.method, choice.substeps);
            let error = flown.error(method, substeps);
            let seconds = time(&flown, method, substeps);
            let (by_hand, with, least) = best.map_or((String::from("none"), 0, f64::NAN), |b| {
                (b.0.to_string(), b.1, b.2)
            });
            let ratio = seconds / least;
            worst = worst.max(ratio);
            println!(
                "{name:<26} {duration:>6} {steps:>6} {tolerance:>7.0e} {:<26} {substeps:>5} {error:>8.1e} {seconds:>9.2e} {by_hand:<26} {with:>5} {least:>9.2e} {ratio:>6.2} {pilot:>9.2e} {:>7} {}",
                method.to_string(),
                choice.evaluations,
                choice.outlook
            );
            if ratio > 1.4 || std::env::var_os("TABLES").is_some() {
                println!("{choice}");
            }
        }
    }
    println!("greatest ratio {worst:.2}");
}
