//! How the time of the chosen run compares with that of the best choice by hand; run in release, ignored otherwise.

use std::time::{Duration, Instant};

use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::rotation::PreprocessedOrder;
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, System};
use nalgebra::{Matrix3, Vector3};

use super::{Flown, RUNS, TOLERANCES};
use crate::case::Case;

/// How many times a flight, or a part of it, is timed; the least time counts.
const REPEATS: usize = 15;

/// What a part of a flight takes that is timed.
const PART: Duration = Duration::from_millis(2);

/// The time (s) of a run, from the fastest of several flights of its first part.
pub fn time(flown: &Flown, method: Method, substeps: u32) -> f64 {
    let mut least = f64::INFINITY;
    let adaptive = matches!(method, Method::DormandPrince853 { .. });
    let whole = if adaptive { flown.run.steps } else { 0 };
    for _ in 0..REPEATS {
        let mut simulation = flown.simulation(method, substeps);
        let controls = vec![Load::default(); simulation.states().len()];
        let begun = Instant::now();
        let mut steps = 0;
        while steps < flown.run.steps && (steps == 0 || begun.elapsed() < PART) {
            for _ in 0..(flown.run.steps - steps).min(8).max(whole) {
                simulation.advance(&controls).expect("a step");
                steps += 1;
            }
        }
        let seconds = begun.elapsed().as_secs_f64();
        least = least.min(seconds * flown.run.steps as f64 / steps as f64);
    }
    least
}

/// What to try by hand: of each method, finer and finer ways to fly it.
fn tries(steps: u64) -> Vec<Vec<(Method, u32)>> {
    let substeps = |method| {
        let mut grid: Vec<_> = (0..80)
            .map(|i| 2_f64.powf(0.25 * f64::from(i)).round())
            .collect();
        grid.dedup();
        let affordable = |n: &f64| n * (steps as f64) < 3e6;
        let grid = grid.into_iter().take_while(affordable);
        grid.map(|n| (method, n as u32)).collect()
    };
    let adaptive = (4..29).map(|i| {
        let tolerance = 10_f64.powf(-0.5 * f64::from(i));
        (Method::DormandPrince853 { tolerance }, 1)
    });
    let exact = Rotor::Exact;
    let rotor = Rotor::default();
    let mut tries = vec![adaptive.collect()];
    tries.extend([rotor, exact].map(|rotor| substeps(Method::Lgvi(rotor))));
    tries.extend([4, 6, 8, 10].map(|order| substeps(Method::Composition { order, rotor })));
    tries.extend([4, 6, 8].map(|order| {
        substeps(Method::Nystrom {
            order,
            rotor: exact,
        })
    }));
    tries
}

#[test]
#[ignore = "a measurement, for release builds"]
fn auto_against_the_best_choice_by_hand() {
    println!(
        "{:<36} {:>6} {:>6} {:>7} {:<36} {:>5} {:>8} {:>9} {:<36} {:>5} {:>9} {:>6} {:>9} {:>7}",
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
    let only = std::env::var("CASE").unwrap_or_default();
    for (name, duration, steps) in RUNS.into_iter().filter(|run| run.0.starts_with(&only)) {
        let flown = Flown::new(name, duration, steps);
        let mut best: Vec<Option<(Method, u32, f64)>> = vec![None; TOLERANCES.len()];
        for tries in tries(steps) {
            let mut next = 0;
            for (method, substeps) in tries {
                if next == TOLERANCES.len() {
                    break;
                }
                let error = flown.error(method, substeps);
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
            let mut seconds = time(&flown, method, substeps);
            let best = best.map(|(method, substeps, seconds)| {
                (
                    method,
                    substeps,
                    seconds.min(time(&flown, method, substeps)),
                )
            });
            if let Some((by_hand, with, least)) = best
                && by_hand == method
                && with == substeps
            {
                seconds = seconds.min(least);
            }
            let (by_hand, with, least) = best.map_or((String::from("none"), 0, f64::NAN), |b| {
                (named(b.0), b.1, b.2)
            });
            let ratio = seconds / least;
            worst = worst.max(ratio);
            println!(
                "{name:<26} {duration:>6} {steps:>6} {tolerance:>7.0e} {:<36} {substeps:>5} {error:>8.1e} {seconds:>9.2e} {by_hand:<36} {with:>5} {least:>9.2e} {ratio:>6.2} {pilot:>9.2e} {:>7} {}",
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

fn named(method: Method) -> String {
    let text = format!("{method:?}");
    let rotors = ["Exact", "Preprocessed"]
        .into_iter()
        .filter(|rotor| text.contains(rotor));
    format!("{method} {}", rotors.collect::<String>())
}

/// The least time (ns) of `work`, in several trials.
fn nanoseconds(mut work: impl FnMut()) -> f64 {
    let trial = |_| {
        let (begun, mut count) = (Instant::now(), 0);
        while count == 0 || begun.elapsed() < PART {
            (0..16).for_each(|_| work());
            count += 16;
        }
        begun.elapsed().as_secs_f64() * 1e9 / f64::from(count)
    };
    (0..3 * REPEATS).map(trial).fold(f64::INFINITY, f64::min)
}

fn step(bodies: &[RigidBody], method: Method, h: f64) -> f64 {
    let turning = |body| {
        let turn = Vector3::new(0.7, -0.4, 0.9);
        BodyState::from_velocities(body, turn, turn, Matrix3::identity(), turn)
    };
    let mut states: Vec<_> = bodies.iter().map(turning).collect();
    let mut system = System::new(bodies.to_vec(), vec![]);
    let mut integrator = method.integrator(&system).expect("a method");
    let controls = vec![Load::default(); bodies.len()];
    integrator.start(&mut system, &states);
    nanoseconds(|| {
        integrator
            .step(&mut system, &mut states, &controls, h)
            .expect("a step");
    })
}

#[test]
#[ignore = "a measurement, for release builds"]
fn auto_costs() {
    let body = |moments: [f64; 3]| {
        let inertia = Inertia::principal(moments).expect("inertia");
        RigidBody::new(1.0, inertia, vec![]).expect("body")
    };
    let pivoted = |moments: [f64; 3]| {
        let inertia = Inertia::principal(moments).expect("inertia");
        RigidBody::pivoted(1.0, inertia, vec![]).expect("body")
    };
    for rotor in [
        Rotor::default(),
        Rotor::Preprocessed(PreprocessedOrder::Six),
        Rotor::Exact,
    ] {
        let one = [pivoted([1.0, 2.0, 3.0])];
        let at = |order| step(&one, Method::Composition { order, rotor }, 0.1);
        println!("pivoted {rotor:?}: stage {:.0}", (at(8) - at(4)) / 16.0);
    }
    for (kind, moments) in [
        ("spherical", [1.0, 1.0, 1.0]),
        ("axisymmetric", [1.0, 2.0, 2.0]),
        ("asymmetric", [1.0, 2.0, 3.0]),
    ] {
        let one = [body(moments)];
        let two = [body(moments), body(moments)];
        for rotor in [
            Rotor::default(),
            Rotor::Preprocessed(PreprocessedOrder::Four),
            Rotor::Preprocessed(PreprocessedOrder::Six),
            Rotor::Preprocessed(PreprocessedOrder::Eight),
            Rotor::Exact,
        ] {
            let lgvi = Method::Lgvi(rotor);
            let long = Method::Composition { order: 8, rotor };
            let short = Method::Composition { order: 4, rotor };
            let stage = |bodies: &[_], h| (step(bodies, long, h) - step(bodies, short, h)) / 16.0;
            println!(
                "{kind:<14} {rotor:?}: stage {:.0} (h = 0.02), {:.0} (h = 0.5), two bodies {:.0}; LGVI {:.0}, {:.0}; order 4 {:.0}",
                stage(&one, 0.02),
                stage(&one, 0.5),
                stage(&two, 0.5),
                step(&one, lgvi, 0.02),
                step(&two, lgvi, 0.02),
                step(&one, short, 0.02),
            );
        }
        println!(
            "{kind:<14} closed form {:.0}, {:.0}",
            step(&one, Method::ClosedForm, 0.1),
            step(&two, Method::ClosedForm, 0.1)
        );
    }
    for (name, duration, _) in RUNS {
        let tolerance = 1e-9;
        let method = Method::DormandPrince853 { tolerance };
        let [few, many] = [1, 10_000].map(|steps| {
            let flown = Flown::new(name, duration, steps);
            let mut simulation = flown.simulation(method, 1);
            let controls = vec![Load::default(); simulation.states().len()];
            let mut made = 0;
            for _ in 0..steps {
                made += simulation.advance(&controls).expect("a step").cuts;
            }
            (time(&flown, method, 1) * 1e9, made)
        });
        println!(
            "{name} to {duration}: Dormand–Prince step {:.0}, state {:.0}; {} {}",
            few.0 / f64::from(few.1),
            (many.0 - few.0) / 1e4,
            few.1,
            many.1
        );
    }
    for (name, _, _) in RUNS {
        let (mut system, states) = Case::load(name).system();
        let mut loads = vec![Load::default(); states.len()];
        println!(
            "{name}: gravity {:.0}",
            nanoseconds(|| system.loads(&states, &mut loads))
        );
    }
}
