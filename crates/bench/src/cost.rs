//! What one LGVI step costs through the public API: time beside a tight loop in C++, and instructions by callgrind.

use std::path::Path;
use std::process::Command;

use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Load, Method, Simulation};
use lgvi_truth::Case;

use crate::clock::Moment;
use crate::error::BenchError;
use crate::peer::compiled;
use crate::spread::{Spread, short};
use crate::tables::Table;

/// What is flown, and its step.
const FLIGHTS: [(&str, &str, f64); 2] = [
    ("free body", "b1_free_asymmetric", 0.01),
    ("two dumbbells", "a1_two_dumbbells_regular", 0.002),
];

/// Steps of a timed block.
const BLOCK: u64 = 1_000_000;

/// Steps between the two flights whose instructions are subtracted.
const COUNTED: [u64; 2] = [1_000, 101_000];

const TIGHT_LOOP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/tight_loop.cpp");

/// Flags of the compiler. Fused multiply–adds round once, so that results differ between processors: lgvi has none.
const FLAGS: [(&str, &[&str]); 2] = [
    ("tight C++ loop", &["-O3", "-march=native"]),
    (
        "the same without fused multiply–adds",
        &["-O3", "-march=native", "-ffp-contract=off"],
    ),
];

fn simulation(which: usize) -> Result<Simulation, BenchError> {
    let (_, name, h) = FLIGHTS[which];
    let (system, states) = Case::load(name)?.system()?;
    Ok(Simulation::new(
        system,
        states,
        Method::Lgvi(Rotor::default()),
        h,
    )?)
}

/// Flies flight `which` for some steps.
pub(crate) fn fly(which: u64, steps: u64) -> Result<(), BenchError> {
    let mut simulation = simulation(usize::from(which > 0))?;
    let controls = vec![Load::default(); simulation.states().len()];
    for _ in 0..steps {
        simulation.advance(&controls)?;
    }
    Ok(())
}

/// Times both flights and the tight loops in turns, counts instructions where there is valgrind; keeps the table `step`.
pub(crate) fn run(repeats: u32, directory: &Path) -> Result<(), BenchError> {
    let tight = FLAGS.map(|(_, flags)| TightLoop::compile(flags));
    for error in tight.iter().filter_map(|tight| tight.as_ref().err()) {
        println!("no tight loop: {error}");
    }
    let mut own = [Vec::new(), Vec::new()];
    let mut beside = FLAGS.map(|_| [Vec::new(), Vec::new()]);
    for _ in 0..repeats {
        for (which, times) in own.iter_mut().enumerate() {
            times.push(step(which)?);
        }
        for (tight, beside) in tight.iter().zip(&mut beside) {
            let Ok(tight) = tight else { continue };
            for (times, time) in beside.iter_mut().zip(tight.run()?) {
                times.push(time);
            }
        }
    }
    let head = FLAGS.iter().flat_map(|(name, _)| [*name, "ratio"]);
    let mut table = Table::new(["", "time"].into_iter().chain(head).chain(["instructions"]));
    for (which, (label, _, _)) in FLIGHTS.iter().enumerate() {
        let median = |times: &Vec<f64>| {
            let spread = Spread::of(times.iter().copied());
            spread.map_or_else(String::new, |spread| format!("{} ns", short(spread.median)))
        };
        let mut row = vec![(*label).to_owned(), median(&own[which])];
        for beside in &beside {
            let ratio = Spread::of_ratios(&own[which], &beside[which]);
            row.push(median(&beside[which]));
            row.push(ratio.map_or_else(String::new, |ratio| ratio.to_string()));
        }
        row.push(instructions(which).map_or_else(
            |error| {
                println!("no instructions: {error}");
                String::new()
            },
            |count| format!("{count:.0}"),
        ));
        table.row(row);
    }
    table.keep(directory, "step")
}

/// Time (ns) of a step of a flight.
fn step(which: usize) -> Result<f64, BenchError> {
    let mut simulation = simulation(which)?;
    let controls = vec![Load::default(); simulation.states().len()];
    let begun = Moment::now();
    for _ in 0..BLOCK {
        simulation.advance(&controls)?;
    }
    Ok(1e9 * begun.elapsed() / BLOCK as f64)
}

/// The C++ loop, compiled here and removed in the end.
struct TightLoop(tempfile::TempPath);

impl TightLoop {
    fn compile(flags: &[&str]) -> Result<Self, BenchError> {
        compiled(TIGHT_LOOP, flags).map(Self)
    }

    /// Times a step (ns) of both flights.
    fn run(&self) -> Result<[f64; 2], BenchError> {
        let output = Command::new(&self.0)
            .arg("1")
            .output()
            .map_err(|error| BenchError::Peer(error.to_string()))?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let mut numbers = text.split_whitespace().map(str::parse::<f64>);
        match (numbers.next(), numbers.next()) {
            (Some(Ok(free)), Some(Ok(pair))) => Ok([free, pair]),
            _ => Err(BenchError::Peer(format!("the tight loop said {text:?}"))),
        }
    }
}

/// Instructions of a step, by the difference of two flights under callgrind.
fn instructions(which: usize) -> Result<f64, BenchError> {
    let this = std::env::current_exe().map_err(|error| BenchError::Peer(error.to_string()))?;
    let mut counts = [0.0; 2];
    for (count, steps) in counts.iter_mut().zip(COUNTED) {
        let output = Command::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg(&this)
            .args(["step", "--fly", &which.to_string(), &steps.to_string()])
            .output()
            .map_err(|error| BenchError::Peer(format!("valgrind: {error}")))?;
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let collected = text
            .lines()
            .find_map(|line| line.split_once("Collected : "));
        *count = collected
            .and_then(|(_, number)| number.trim().parse().ok())
            .ok_or_else(|| BenchError::Peer(format!("valgrind said {text:?}")))?;
    }
    Ok((counts[1] - counts[0]) / (COUNTED[1] - COUNTED[0]) as f64)
}
