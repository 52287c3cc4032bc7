//! Benchmarks: run time against error, beside outside peers when they are installed.
//!
//! Times are the best of several repetitions in one run, and only their ratios mean anything. What the nodes cost is
//! measured once, over seconds.

#![allow(clippy::print_stdout)]

mod auto;
mod bag;
mod clock;
mod corrected;
mod cost;
mod costs;
mod dumbbells;
mod error;
mod feedback;
mod flight;
mod free;
mod laziness;
mod maneuvers;
mod methods;
mod peer;
mod picture;
mod planner;
mod precision;
mod recording;
mod run;

use std::path::PathBuf;

use clap::{Parser, Subcommand};

use error::BenchError;
use peer::Peer;

/// Benchmarks of lgvi: run time against error.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Repetitions of each measurement, of which the fastest counts.
    #[arg(long, default_value_t = 5, global = true)]
    repeats: u32,
    /// The Python that has heyoka or casadi (`pip install heyoka casadi`); without it there is no peer.
    #[arg(long, global = true)]
    python: Option<PathBuf>,
    /// Directory for pictures.
    #[arg(long, default_value = "target/bench", global = true)]
    images: PathBuf,
}

#[derive(Subcommand)]
enum Command {
    /// Every integrator on a reference case: run time against error, and the ratios to heyoka.
    Precision {
        /// The case, such as `a1_two_dumbbells_regular`; all of them without one.
        case: Option<String>,
    },
    /// The free body in closed form, at any time.
    Free,
    /// Time and instructions of one step through the public API.
    Step {
        /// Only fly this many steps of a free body (0) or of two dumbbells (1): what callgrind counts.
        #[arg(long, num_args = 2, hide = true)]
        fly: Option<Vec<u64>>,
    },
    /// The automatic choice of method and step against the best by hand.
    Auto {
        /// A scene or a reference case, such as `pendulum`; all of them without one.
        name: Option<String>,
    },
    /// What steps, stages and gravity cost: the constants of the automatic choice.
    Costs,
    /// The planner's solver: beside CasADi with IPOPT and fatrop, against the number of steps, and from a plan before.
    Planner(planner::Options),
    /// The two-dumbbell figure of the paper's §3.4, as pictures.
    Dumbbells,
    /// How many random manoeuvres the planner solves from nothing, beside plain shooting.
    Maneuvers {
        /// How many, from the first on.
        #[arg(long, default_value_t = 1000)]
        count: u64,
        /// Of the generator.
        #[arg(long, default_value_t = lgvi_truth::maneuvers::SEED)]
        seed: u64,
    },
    /// Writing bags, beside the crate mcap alone.
    Bag,
    /// What the propagator costs by who listens; needs `cargo build -p lgvi` of the same profile.
    Laziness(laziness::Options),
    /// What the recorder costs at 10 kHz, and from which rate on states are lost; needs `cargo build -p lgvi` of the same
    /// profile.
    Recording(recording::Options),
    /// How far disturbed flights of a plan miss, with and without feedback and new plans on the way.
    Feedback {
        /// Flights of each kind.
        #[arg(long, default_value_t = 200)]
        flights: u64,
        /// Steps of a flight.
        #[arg(long, default_value_t = 200)]
        intervals: usize,
    },
}

fn main() -> Result<(), BenchError> {
    let arguments = Arguments::parse();
    let peer = arguments.python.map(Peer::new);
    let repeats = arguments.repeats.max(1);
    match arguments.command {
        Command::Precision { case } => {
            let known = || precision::CASES.iter().map(|case| case.name.to_string());
            let cases: Vec<_> = case.map_or_else(|| known().collect(), |case| vec![case]);
            for case in cases {
                precision::run(&case, peer.as_ref(), repeats, &arguments.images)?;
            }
            Ok(())
        }
        Command::Free => free::run(peer.as_ref(), repeats),
        Command::Step { fly: Some(which) } => cost::fly(which[0], which[1]),
        Command::Step { fly: None } => cost::run(repeats),
        Command::Auto { name } => auto::run(name.as_deref(), repeats),
        Command::Costs => costs::run(repeats),
        Command::Planner(options) => {
            planner::run(&options, peer.as_ref(), repeats, &arguments.images)
        }
        Command::Dumbbells => dumbbells::run(repeats, &arguments.images),
        Command::Maneuvers { count, seed } => maneuvers::run(count, seed, &arguments.images),
        Command::Bag => bag::run(repeats),
        Command::Laziness(options) => laziness::run(&options),
        Command::Recording(options) => recording::run(&options),
        Command::Feedback { flights, intervals } => {
            feedback::run(flights, intervals, &arguments.images)
        }
    }
}
