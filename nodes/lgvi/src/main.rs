//! `lgvi`: the front door to the node suite.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "it talks to a person at a terminal"
)]

mod flight_bag;
mod plot;
mod run;
mod verify;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use lgvi_node::NodeError;

/// Fly rigid bodies in ROS 2: plan, propagate, record, replay, verify.
#[derive(Parser)]
#[command(version, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Flies a scene: starts planner, propagator and recorder, and ends when everything is recorded.
    Run(run::Options),
    /// Repeats a recorded flight from its scene and controls, and compares every state bit for bit.
    Verify {
        /// The bag's directory, or its MCAP file.
        bag: PathBuf,
        /// Print the result as one JSON object.
        #[arg(long)]
        json: bool,
    },
    /// Draws a recorded flight: its motion in space, controls, energy and momentum.
    Plot {
        /// The bag's directory, or its MCAP file.
        bag: PathBuf,
        /// The SVG file to write [default: flight.svg in the bag's directory].
        #[arg(long)]
        output: Option<PathBuf>,
    },
    /// Replays a bag over shared memory and DDS.
    Play {
        /// The bag's directory, or its MCAP file.
        bag: PathBuf,
        /// Recorded seconds a second; 0 means as fast as possible, without loss.
        #[arg(long, default_value_t = 1.0)]
        rate: f64,
        /// Publish `/clock` at the recorded times.
        #[arg(long)]
        clock: bool,
    },
    /// Runs one node of the suite; what follows is its own command line.
    Node {
        /// Which node.
        node: NodeKind,
        /// The node's arguments, such as `--ros-args -p scene:=scenes/free_body.toml`.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
}

/// The nodes of the suite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
enum NodeKind {
    Propagator,
    Planner,
    Recorder,
    Player,
}

impl NodeKind {
    /// Runs the node in this process.
    fn run(self, arguments: Vec<String>) -> ExitCode {
        match self {
            Self::Propagator => lgvi_propagator::main(arguments),
            Self::Planner => lgvi_planner::main(arguments),
            Self::Recorder => lgvi_recorder::main(arguments),
            Self::Player => lgvi_player::main(arguments),
        }
    }
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Run(options) => run::run(&options),
        Command::Verify { bag, json } => verify::verify(&bag, json),
        Command::Plot { bag, output } => plot::plot(&bag, output.as_deref()).map(|picture| {
            println!("{}", picture.display());
            ExitCode::SUCCESS
        }),
        Command::Play { bag, rate, clock } => {
            let parameters = [
                format!("bag:={}", run::yaml(&bag)),
                format!("rate:={rate:?}"),
                format!("clock:={clock}"),
            ];
            return NodeKind::Player.run(run::ros_arguments(parameters));
        }
        Command::Node { node, arguments } => return node.run(arguments),
    };
    outcome.unwrap_or_else(|error: NodeError| {
        eprintln!("lgvi: {error}");
        error.exit_code()
    })
}
