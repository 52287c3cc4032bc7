//! Benchmarks: run time against error, beside outside peers when they are installed.
//!
//! Times are of the processor, of several repetitions in turns, and only their ratios mean anything. What the nodes cost
//! is measured once, over seconds.

#![allow(clippy::print_stdout, clippy::print_stderr)]

mod all;
mod auto;
mod bag;
mod bodies;
mod clock;
mod contents;
mod corrected;
mod cost;
mod costs;
mod dumbbells;
mod ensemble;
mod error;
mod feedback;
mod free;
mod laziness;
mod long;
mod maneuvers;
mod methods;
mod peer;
mod picture;
mod planner;
mod polyhedra;
mod precision;
mod promises;
mod recording;
mod run;
mod skip;
mod spread;
mod stress;
mod tables;
mod transport;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use error::BenchError;
use peer::{CASADI, HEYOKA, INTEGRATORS, Peer, Python, REBOUND};

/// Benchmarks of lgvi: run time against error.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Repetitions of each measurement.
    #[arg(long, default_value_t = 5, global = true)]
    repeats: u32,
    /// The Python that has the peers, as crates/bench/peers/environment.py prints it; without it there is none.
    #[arg(long, global = true)]
    python: Option<PathBuf>,
    /// Directory for figures (JSON), pictures (SVG) and tables.
    #[arg(long, default_value = "target/bench", global = true)]
    output: PathBuf,
}

#[derive(Subcommand)]
enum Command {
    /// All of them one after the other; replaces the documentation's tables and pictures.
    All(all::Options),
    /// Every integrator on the reference cases: run time against error, beside peers.
    Precision(precision::Options),
    /// The free body in closed form, at any time.
    Free,
    /// Energy and phase over 1e6 orbits of planets and 100 years of a binary asteroid, beside peers. Takes half an hour.
    Long {
        /// Only a thousandth of the time, without peers.
        #[arg(long)]
        quick: bool,
    },
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
        /// Instead, the errors of so many random flights in their tolerances.
        #[arg(long, conflicts_with = "name")]
        scenes: Option<u64>,
        /// Of the random flights.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// What skipping saves in each scene, and what it changes.
    Skip {
        /// A scene, such as `rocks`; all of them without one.
        name: Option<String>,
    },
    /// What steps, stages and gravity cost: the constants of the automatic choice.
    Costs,
    /// The planner's solver: beside CasADi with IPOPT and fatrop, against the number of steps, and from a plan before.
    Planner(planner::Options),
    /// The two-dumbbell figure of the paper's §3.4, as pictures.
    Dumbbells,
    /// Throughput of ensembles: lanes beside the simulation, threads, size.
    Ensemble(ensemble::Options),
    /// How many random maneuvers the planner solves from nothing, beside plain shooting.
    Maneuvers {
        /// How many, from the first on.
        #[arg(long, default_value_t = 1000)]
        count: u64,
        /// Of the generator.
        #[arg(long, default_value_t = lgvi_truth::maneuvers::SEED)]
        seed: u64,
    },
    /// The planner beside CasADi with IPOPT and fatrop on random maneuvers of many kinds, with inequalities, and on as many that keep a
    /// sphere with a probability although their start deviates.
    Varied {
        /// How many, from the first on.
        #[arg(long, default_value_t = 300)]
        count: u64,
        /// Of the generator.
        #[arg(long, default_value_t = lgvi_truth::maneuvers::SEED)]
        seed: u64,
        /// Steps of a maneuver.
        #[arg(long, default_value_t = 100)]
        steps: usize,
    },
    /// The planner beside CasADi with IPOPT and fatrop on random maneuvers by thrusters, at least energy, at minimum fuel and in phases, and
    /// on random turns by reaction wheels, at least energy and in the shortest time.
    Actuators {
        /// How many of each kind, from the first on.
        #[arg(long, default_value_t = 30)]
        count: u64,
        /// Of the generator.
        #[arg(long, default_value_t = lgvi_truth::maneuvers::SEED)]
        seed: u64,
        /// Steps of a maneuver.
        #[arg(long, default_value_t = 100)]
        steps: usize,
    },
    /// Trials that drive the dynamics to its limits, some minutes of them; fails where one does.
    Stress {
        /// A family of trials, such as `rounding`; all of them without one.
        family: Option<String>,
    },
    /// What a step costs against the number of bodies, beside REBOUND.
    Bodies {
        /// Only few bodies, without REBOUND.
        #[arg(long)]
        quick: bool,
    },
    /// Polyhedra of many faces: an orbit about one and the attraction of two, beside a plain C++ loop.
    Polyhedra,
    /// States from one process to another: latency and processor time, beside bare iceoryx2 and ros2-client.
    Transport(transport::Options),
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

impl Command {
    /// Peers that it compares with. `all` names those of its parts itself.
    fn peers(&self) -> &'static [Peer] {
        match self {
            Self::Precision(options) if !options.quick => &INTEGRATORS,
            Self::Free => &[HEYOKA],
            Self::Planner(options) if options.beside_peers() => &[CASADI],
            Self::Varied { .. } => &[CASADI],
            Self::Bodies { quick: false } => &[REBOUND],
            _ => &[],
        }
    }
}

fn main() -> ExitCode {
    match run(Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("lgvi_bench: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: Arguments) -> Result<(), BenchError> {
    let python = arguments.python.map(Python::new).transpose()?;
    let missing = peer::missing(python.as_ref(), arguments.command.peers());
    let ran = dispatch(
        arguments.command,
        python.as_ref(),
        arguments.repeats.max(1),
        &arguments.output,
    );
    for peer in missing {
        println!("left out: the peer {}", peer.name);
    }
    ran
}

fn dispatch(
    command: Command,
    python: Option<&Python>,
    repeats: u32,
    output: &Path,
) -> Result<(), BenchError> {
    match command {
        Command::All(options) => all::run(&options, python, repeats, output),
        Command::Precision(options) => match precision::run(&options, python, repeats, output)? {
            lost if lost.is_empty() => Ok(()),
            lost => Err(BenchError::Failed(
                lost.iter().map(ToString::to_string).collect(),
            )),
        },
        Command::Free => free::run(python, repeats, output),
        Command::Long { quick } => long::run(quick, python, output),
        Command::Step { fly: Some(which) } => cost::fly(which[0], which[1]),
        Command::Step { fly: None } => cost::run(repeats, output),
        Command::Auto {
            scenes: Some(scenes),
            seed,
            ..
        } => promises::run(scenes, seed, output),
        Command::Auto { name, .. } => auto::run(name.as_deref(), repeats),
        Command::Skip { name } => skip::run(name.as_deref(), repeats, output),
        Command::Costs => costs::run(repeats),
        Command::Planner(options) => planner::run(&options, python, repeats, output),
        Command::Dumbbells => dumbbells::run(repeats, output),
        Command::Maneuvers { count, seed } => maneuvers::run(count, &[seed], output),
        Command::Varied { count, seed, steps } => {
            planner::varied(count, seed, steps, python, output)
        }
        Command::Actuators { count, seed, steps } => {
            planner::actuators(count, seed, steps, python, output)
        }
        Command::Bodies { quick } => bodies::run(quick, python, repeats, output),
        Command::Polyhedra => polyhedra::run(repeats, output),
        Command::Transport(options) => transport::run(&options, output),
        Command::Bag => bag::run(repeats, output),
        Command::Laziness(options) => laziness::run(&options, output),
        Command::Recording(options) => recording::run(&options, output),
        Command::Feedback { flights, intervals } => feedback::run(flights, intervals, output),
        Command::Ensemble(options) => ensemble::run(&options, repeats, output),
        Command::Stress { family } => match stress::run(family.as_deref(), output)? {
            failed if failed.is_empty() => Ok(()),
            failed => Err(BenchError::Stress(failed.join(", "))),
        },
    }
}
