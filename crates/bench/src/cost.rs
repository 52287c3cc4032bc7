//! What one LGVI step costs through the public API: time beside a tight loop in C++, and instructions by callgrind.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Load, Method, Simulation};
use lgvi_truth::Case;

use crate::error::BenchError;

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

/// Times both flights and the tight loops, counts instructions where there is valgrind.
pub(crate) fn run(repeats: u32) -> Result<(), BenchError> {
    let tight = tight_loop(repeats);
    for (which, (label, _, _)) in FLIGHTS.iter().enumerate() {
        let mut simulation = simulation(which)?;
        let controls = vec![Load::default(); simulation.states().len()];
        let mut best = f64::INFINITY;
        for _ in 0..repeats {
            let start = Instant::now();
            for _ in 0..BLOCK {
                simulation.advance(&controls)?;
            }
            best = best.min(1e9 * start.elapsed().as_secs_f64() / BLOCK as f64);
        }
        print!("{label}: {best:.1} ns a step");
        match &tight {
            Ok(tight) => print!(
                ", {:.2} times the tight loop ({:.1} ns)",
                best / tight[which],
                tight[which]
            ),
            Err(error) => print!(" (no tight loop: {error})"),
        }
        match instructions(which) {
            Ok(count) => println!(", {count:.0} instructions"),
            Err(error) => println!(" (no instructions: {error})"),
        }
    }
    Ok(())
}

/// Best times a step (ns) of the C++ loop, compiled here.
fn tight_loop(repeats: u32) -> Result<[f64; 2], BenchError> {
    let program = std::env::temp_dir().join(format!("lgvi_tight_loop_{}", std::process::id()));
    let result = compile_and_run(&program, repeats);
    let _ = std::fs::remove_file(&program);
    result
}

fn compile_and_run(program: &Path, repeats: u32) -> Result<[f64; 2], BenchError> {
    let compiled = Command::new("g++")
        .args(["-O3", "-march=native", TIGHT_LOOP, "-o"])
        .arg(program)
        .status()
        .map_err(|error| BenchError::Peer(format!("g++: {error}")))?;
    if !compiled.success() {
        return Err(BenchError::Peer(format!("g++ ended with {compiled}")));
    }
    let output = Command::new(program)
        .arg(repeats.to_string())
        .output()
        .map_err(|error| BenchError::Peer(error.to_string()))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut numbers = text.split_whitespace().map(str::parse::<f64>);
    match (numbers.next(), numbers.next()) {
        (Some(Ok(free)), Some(Ok(pair))) => Ok([free, pair]),
        _ => Err(BenchError::Peer(format!("the tight loop said {text:?}"))),
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
