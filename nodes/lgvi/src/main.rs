//! `lgvi`: the front door to the node suite.
mod course;
mod explain;
mod flight_bag;
mod output;
mod plot;
mod run;
mod values;
mod verify;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use lgvi_node::{NodeError, complain};

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
    /// Says what a scene is, how it will be flown, and what to mind.
    Explain {
        /// The scene file.
        #[arg(value_parser = values::path())]
        scene: PathBuf,
        /// Print the explanation as one JSON object.
        #[arg(long)]
        json: bool,
    },
    /// Repeats a recorded flight from its scene and controls, and compares every state bit for bit.
    Verify {
        /// The bag's directory, or its MCAP file.
        #[arg(value_parser = values::path())]
        bag: PathBuf,
        /// Print the result as one JSON object.
        #[arg(long)]
        json: bool,
    },
    /// Draws a recorded flight: its motion in space, controls, energy and momentum.
    Plot {
        /// The bag's directory, or its MCAP file.
        #[arg(value_parser = values::path())]
        bag: PathBuf,
        /// The SVG file to write [default: flight.svg in the bag's directory].
        #[arg(long, value_parser = values::path())]
        output: Option<PathBuf>,
    },
    /// Replays a bag over shared memory and DDS.
    Play {
        /// The bag's directory, or its MCAP file.
        #[arg(value_parser = values::path())]
        bag: PathBuf,
        /// Recorded seconds a second; 0 means as fast as possible, without loss.
        #[arg(long, default_value_t = 1.0, value_parser = values::rate, allow_negative_numbers = true)]
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
    /// What it is called on the command line and in messages.
    fn name(self) -> &'static str {
        match self {
            Self::Propagator => "propagator",
            Self::Planner => "planner",
            Self::Recorder => "recorder",
            Self::Player => "player",
        }
    }

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
        Command::Explain { scene, json } => explain::explain(&scene, json),
        Command::Verify { bag, json } => verify::verify(&bag, json),
        Command::Plot { bag, output } => plot::plot(&bag, output.as_deref())
            .and_then(|picture| output::say(&picture.display()))
            .map(|()| ExitCode::SUCCESS),
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
        complain(&format_args!("lgvi: {error}"));
        error.exit_code()
    })
}
