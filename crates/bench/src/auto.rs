//! The automatic choice of method and step against the best choice by hand, as a table.

use std::path::Path;

use lgvi_dynamics::auto::ChoiceError;
use lgvi_dynamics::integrator::{KeplerScheme, Rotor};
use lgvi_dynamics::{Load, Method};

use crate::clock::Moment;
use crate::error::BenchError;
use crate::run::{Run, Truth};
use crate::spread::Spread;
use crate::tables::Table;

const TOLERANCES: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];

/// Of what was found by hand, how many are timed again beside the choice.
const FINALISTS: usize = 3;

/// Flights that take so many times as long as what was found cannot win.
const HOPELESS: f64 = 1.5;

/// Seconds that a flight by hand may take.
const PATIENCE: f64 = 5.0;

/// Seconds of a flight's first part that are timed where its steps are alike, and of all its repetitions.
const PART: f64 = 2e-3;
const TIMED: f64 = 0.5;

/// A flight that reaches a tolerance.
#[derive(Clone, Copy)]
struct Try {
    method: Method,
    substeps: u32,
    seconds: f64,
}

/// Prints what was chosen in the run called `name`, or in all.
pub(crate) fn run(name: Option<&str>, repeats: u32) -> Result<(), BenchError> {
    let all = Run::all()?;
    let named = |run: &&Run| name.is_none_or(|name| run.name == name);
    let runs: Vec<_> = all.iter().filter(named).collect();
    if runs.is_empty() {
        return Err(BenchError::Run {
            name: name.unwrap_or_default().into(),
            known: all.into_iter().map(|run| run.name).collect(),
        });
    }
    measure(&runs, repeats).map(|table| table.print())
}

/// The same for the shipped scenes; keeps the table `auto` of the ratios.
pub(crate) fn scenes(repeats: u32, directory: &Path) -> Result<(), BenchError> {
    let all = Run::all()?;
    let scenes: Vec<_> = all.iter().filter(|run| run.is_scene()).collect();
    measure(&scenes, repeats)?.keep(directory, "auto")
}

/// Prints the choices; the table has times in parts of the best by hand.
fn measure(runs: &[&Run], repeats: u32) -> Result<Table, BenchError> {
    println!(
        "| run | steps | tolerance | chosen | error | time (ms) | best by hand | time (ms) | ratio | choosing (ms) |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut notes = Vec::new();
    let head = TOLERANCES.map(|tolerance| format!("{tolerance:.0e}"));
    let mut table = Table::new(std::iter::once("run".to_owned()).chain(head));
    for run in runs {
        let truth = run.truth()?;
        if let Truth::Flown(_, difference) = truth {
            notes.push(format!(
                "{}: the references differ by {difference:.1e}",
                run.name
            ));
        }
        let found = by_hand(run, &truth)?;
        let mut cells = vec![format!("`{}` to {}", run.name, run.wanted.duration)];
        for (tolerance, found) in TOLERANCES.into_iter().zip(found) {
            let (ratio, note) = row(run, &truth, tolerance, found, repeats)?;
            cells.push(ratio.map_or_else(String::new, |ratio| ratio.to_string()));
            notes.extend(note);
        }
        table.row(cells);
    }
    println!();
    for note in notes {
        println!("{note}");
    }
    Ok(table)
}

/// Prints a row; the ratio of times, and why the choice was made where it takes much longer than the best.
fn row(
    run: &Run,
    truth: &Truth,
    tolerance: f64,
    mut found: Vec<Try>,
    repeats: u32,
) -> Result<(Option<Spread>, Option<String>), BenchError> {
    let begun = Moment::now();
    let choice = match run.choose(tolerance) {
        Ok(choice) => choice,
        Err(BenchError::Choice(refused @ ChoiceError::Floor { .. })) => {
            return Ok((None, Some(format!("{}: {refused}", run.name))));
        }
        Err(error) => return Err(error),
    };
    let choosing = begun.elapsed();
    let (method, substeps) = (choice.method, choice.substeps);
    let (error, _) = run.fly(method, substeps, truth)?;
    let chosen = Try {
        method,
        substeps,
        seconds: f64::INFINITY,
    };
    found.truncate(FINALISTS);
    let mut tries = vec![chosen];
    tries.extend(found);
    let mut times = vec![Vec::new(); tries.len()];
    let begun = Moment::now();
    for repeat in 0..repeats {
        if repeat > 1 && begun.elapsed() > TIMED {
            break;
        }
        for (timed, times) in tries.iter().zip(&mut times) {
            times.push(time(run, timed)?);
        }
    }
    for (timed, times) in tries.iter_mut().zip(&times) {
        let spread = Spread::of(times.iter().copied());
        timed.seconds = spread.map_or(f64::NAN, |spread| spread.median);
    }
    let chosen = tries[0];
    let best = (1..tries.len()).min_by(|a, b| tries[*a].seconds.total_cmp(&tries[*b].seconds));
    let spread = best.and_then(|best| Spread::of_ratios(&times[0], &times[best]));
    let best = best.map(|best| &tries[best]);
    let seconds = best.map_or(f64::NAN, |best| best.seconds);
    let ratio = spread.map_or(f64::NAN, |spread| spread.median);
    println!(
        "| {} to {} | {} | {tolerance:.0e} | {} | {error:.1e} | {:.3} | {} | {:.3} | {ratio:.2} | {:.1} |",
        run.name,
        run.wanted.duration,
        run.wanted.steps,
        label(&chosen),
        1e3 * chosen.seconds,
        best.map_or("none".into(), label),
        1e3 * seconds,
        1e3 * choosing
    );
    let note = (ratio > HOPELESS).then(|| format!("{} to {tolerance:.0e}: {choice}", run.name));
    Ok((spread, note))
}

fn label(flight: &Try) -> String {
    match flight.substeps {
        1 => flight.method.to_string(),
        substeps => format!("{}, {substeps} substeps", flight.method),
    }
}

/// For each tolerance what reaches it, the fastest first.
fn by_hand(run: &Run, truth: &Truth) -> Result<Vec<Vec<Try>>, BenchError> {
    let mut found: Vec<Vec<Try>> = vec![Vec::new(); TOLERANCES.len()];
    for tries in tries(run)? {
        let mut reached = 0;
        let mut before: Option<Try> = None;
        for (method, substeps) in tries {
            let useful = |seconds: f64| {
                let least = |found: &Vec<Try>| {
                    let seconds = found.iter().map(|found| found.seconds);
                    seconds.fold(PATIENCE, f64::min)
                };
                let most = found[reached..].iter().map(least).fold(0.0, f64::max);
                seconds < HOPELESS * most
            };
            let predicted = before.as_ref().map_or(0.0, |before| {
                before.seconds * f64::from(substeps) / f64::from(before.substeps)
            });
            if !useful(predicted) {
                break;
            }
            let (error, seconds) = run.fly(method, substeps, truth)?;
            let made = Try {
                method,
                substeps,
                seconds,
            };
            while reached < TOLERANCES.len() && error <= TOLERANCES[reached] {
                found[reached].push(made);
                reached += 1;
            }
            before = seconds.is_finite().then_some(made);
            if reached == TOLERANCES.len() {
                break;
            }
        }
    }
    for found in &mut found {
        found.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    }
    Ok(found)
}

/// What to try by hand: of each method that can integrate the bodies, finer and finer ways to fly it.
fn tries(run: &Run) -> Result<Vec<Vec<(Method, u32)>>, BenchError> {
    let mut substeps: Vec<_> = (0..50)
        .map(|i| 2_f64.powf(0.5 * f64::from(i)).round() as u32)
        .collect();
    substeps.dedup();
    let finer = |method| substeps.iter().map(|n| (method, *n)).collect();
    let tolerances = || (4..29).map(|i| 10_f64.powf(-0.5 * f64::from(i)));
    let dormand_prince = tolerances().map(|tolerance| Method::DormandPrince853 { tolerance });
    let taylor = tolerances().map(|tolerance| Method::Taylor { tolerance });
    let once = |method| (method, 1);
    let mut tries = vec![
        vec![once(Method::ClosedForm)],
        dormand_prince.map(once).collect(),
        taylor.map(once).collect(),
    ];
    let exact = Rotor::Exact;
    tries.extend([8, 6, 4].map(|order| finer(Method::Nystrom { order })));
    tries.extend(KeplerScheme::ALL.map(|scheme| finer(Method::WisdomHolman { scheme })));
    let rotor = Rotor::default();
    tries.extend([10, 8, 6, 4].map(|order| finer(Method::Composition { order, rotor })));
    tries.extend([rotor, exact].map(|rotor| finer(Method::Lgvi(rotor))));
    let (system, _) = run.system()?;
    tries.retain(|tries| tries[0].0.integrator(&system).is_ok());
    Ok(tries)
}

/// The time (s) of a flight; from its first part where all steps are alike.
fn time(run: &Run, flight: &Try) -> Result<f64, BenchError> {
    let steps = run.wanted.steps;
    let mut simulation = run.simulation(flight.method, steps, flight.substeps)?;
    let controls = vec![Load::default(); simulation.states().len()];
    let alike = !flight.method.has_error_control();
    let begun = Moment::now();
    let mut made = 0;
    while made < steps && !(alike && made > 0 && begun.elapsed() > PART) {
        // the clock is read seldom, for that takes as long as some steps
        for _ in 0..(steps - made).min(made.max(8)) {
            simulation.advance(&controls)?;
            made += 1;
        }
    }
    Ok(begun.elapsed() * steps as f64 / made as f64)
}
