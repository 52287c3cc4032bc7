//! State samples from one process to another: latency, time on the processor and losses, through this project's middleware
//! and through the bare libraries below it.

mod dds;
mod events;
mod far;
mod near;
mod report;
mod ros;
mod shm;
mod way;
mod zenoh;

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::error::BenchError;
use far::FarOptions;
use way::Way;

/// What is measured.
#[derive(Args)]
pub(crate) struct Options {
    /// Seconds of each measurement.
    #[arg(long, default_value_t = Self::default().seconds)]
    seconds: f64,
    /// Rounds, in which all ways are measured in turns.
    #[arg(long, default_value_t = Self::default().rounds)]
    rounds: u32,
    /// The DDS domain, which nobody else should use.
    #[arg(long, default_value_t = Self::default().domain)]
    domain: u16,
    #[command(flatten)]
    far: FarOptions,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seconds: 1.0,
            rounds: 3,
            domain: 102,
            far: FarOptions::default(),
        }
    }
}

const BODIES: [usize; 3] = [1, 5, 64];
const RATES: [f64; 2] = [1_000.0, 10_000.0];

/// How a receiver looks for samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Look {
    /// All the time: its latency is that of the transport alone.
    Spinning,
    /// Every millisecond, as nodes do: its time on the processor is what it costs.
    Polling,
    /// It is woken.
    Woken,
}

/// One kind of measurement.
#[derive(Clone, Copy, Debug, Serialize)]
struct Setup {
    way: Way,
    bodies: usize,
    /// Samples a second.
    rate: f64,
    look: Look,
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
struct Measured {
    setup: Setup,
    rounds: Vec<Round>,
}

/// Once measured.
#[derive(Clone, Copy, Debug, Serialize)]
struct Round {
    /// From before sending to after receiving (s).
    median: f64,
    percentile_99: f64,
    most: f64,
    received: u64,
    lost: u64,
    /// Seconds on the processor a sample, of the whole process.
    sending: f64,
    receiving: f64,
}

/// Measures, keeps `transport.json`, the table `transport` and a picture.
pub(crate) fn run(options: &Options, directory: &Path) -> Result<(), BenchError> {
    if let Some(way) = options.far.way {
        return far::run(&options.far, way, options.domain, options.seconds);
    }
    let root = std::env::temp_dir().join(format!("lgvi_transport_{}", std::process::id()));
    std::fs::create_dir_all(&root).map_err(failed)?;
    let measured = measure(options, &root);
    let _ = std::fs::remove_dir_all(&root);
    report::keep(&measured?, directory)
}

fn measure(options: &Options, root: &Path) -> Result<Vec<Measured>, BenchError> {
    let mut all: Vec<_> = setups()
        .map(|setup| Measured {
            setup,
            rounds: Vec::new(),
        })
        .collect();
    for round in 1..=options.rounds {
        println!("round {round} of {}", options.rounds);
        for measured in &mut all {
            let setup = measured.setup;
            measured.rounds.push(near::measure(setup, options, root)?);
        }
    }
    Ok(all)
}

fn setups() -> impl Iterator<Item = Setup> {
    let sizes = BODIES.into_iter();
    let sizes = sizes.flat_map(|bodies| RATES.map(|rate| (bodies, rate)));
    sizes.flat_map(|(bodies, rate)| {
        let setup = move |(way, look)| Setup {
            way,
            bodies,
            rate,
            look,
        };
        way::LOOKS.map(setup)
    })
}

/// Where processes of one measurement meet.
#[derive(Clone, Debug)]
struct Place {
    domain: u16,
    root: PathBuf,
}

fn failed(error: impl std::fmt::Display) -> BenchError {
    BenchError::Nodes(error.to_string())
}
