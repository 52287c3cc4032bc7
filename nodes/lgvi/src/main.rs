//! `lgvi`: the front door to the node suite.
mod beside;
mod choosing;
mod chosen;
mod convert;
mod course;
mod ensemble;
mod explain;
mod files;
mod flight_bag;
mod info;
mod output;
mod parameters;
mod play;
mod plot;
mod record;
mod recover;
mod run;
mod strictness;
mod values;
mod verify;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use lgvi_node::{NodeError, complain, let_long_files_fail};

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
    ///
    /// Exit code 0: flown and recorded without loss. 1: something failed, or messages were lost. 2: the scene cannot be used.
    /// 3: flown and recorded, with warnings, and `--strict` was given. 130: it was stopped before the end.
    Run(run::Options),
    /// Says what a scene is, how it will be flown, and what to mind.
    ///
    /// Exit code 0: the scene can be flown. 3: it can, with warnings, and `--strict` was given. 2: it cannot be used.
    Explain(explain::Options),
    /// Says what is in a bag: files, topics, times, losses.
    ///
    /// Looks at what the files tell at their ends; with --check at all they hold. Exit code 0: the bag is complete, as far as
    /// was looked. 1: only a part of it can be read, which is said. 2: it cannot be used.
    Info(info::Options),
    /// Repeats a recorded flight from its scene and controls, and compares every state bit for bit.
    ///
    /// Exit code 0: all recorded states agree, of an interrupted flight too, which is said. 1: one differs. 2: the bag cannot
    /// be verified, or the result not be told.
    Verify {
        /// The bag's directory, or its MCAP file.
        #[arg(value_parser = values::path())]
        bag: PathBuf,
        /// The propagator whose flight it is, such as `/lgvi_propagator`, where the bag has those of several.
        #[arg(long, value_name = "NAME")]
        flight: Option<String>,
        /// Print the result as one JSON object.
        #[arg(long)]
        json: bool,
    },
    /// Makes CSV or Parquet files of a bag's topics, one of each.
    ///
    /// Any rosbag2 bag of MCAP files will do. Ends with 1 where a topic had to be left out, which is said and why.
    Convert(convert::Options),
    /// Makes a new bag of what is readable of a damaged one, as a killed recorder or a full disk leaves it.
    ///
    /// Exit code 0: nothing is missing but the end that was not written. 1: there is a new bag, and something was left out of
    /// it, or messages are missing by the bag's own counts. 2: no bag can be made, or nothing is readable, and why.
    Recover(recover::Options),
    /// Draws a recorded flight: its motion in space, controls, energy and momentum.
    ///
    /// Only flight.svg in the bag's directory is ever made anew; any other file that exists is left as it is.
    Plot {
        /// The bag's directory, or its MCAP file.
        #[arg(value_parser = values::path())]
        bag: PathBuf,
        /// The propagator whose flight it is, such as `/lgvi_propagator`, where the bag has those of several.
        #[arg(long, value_name = "NAME")]
        flight: Option<String>,
        /// The SVG file to write (default: flight.svg in the bag's directory).
        #[arg(long, value_parser = values::path())]
        output: Option<PathBuf>,
    },
    /// Flies a scene many times over, each sample with deviations of its own (Monte Carlo), or joins such flights.
    ///
    /// Exit code 0: all samples that were asked for are there; how many of them failed is said. 1: it was ended before, or
    /// results could not be written. 2: the scene or the parts that are there cannot be used.
    #[command(subcommand)]
    Ensemble(ensemble::Command),
    /// Records what is on the air, over shared memory and DDS, until it is stopped.
    Record(record::Options),
    /// Replays a bag over shared memory and DDS.
    Play(play::Options),
    /// Runs one node of the suite; what follows is its own command line.
    Node {
        /// Which node.
        node: NodeKind,
        /// The node's arguments, such as `--ros-args -p scene:=scenes/free_body.toml`.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
}

impl Command {
    /// Whether what it says is to be one JSON object.
    fn prints_json(&self) -> bool {
        match self {
            Self::Run(options) => options.json,
            Self::Info(options) => options.json,
            Self::Convert(options) => options.json,
            Self::Recover(options) => options.json,
            Self::Ensemble(command) => command.prints_json(),
            Self::Explain(options) => options.json,
            Self::Verify { json, .. } => *json,
            Self::Plot { .. } | Self::Record(_) | Self::Play(_) | Self::Node { .. } => false,
        }
    }

    /// The exit code of a failure; 1 is not for those whose findings it tells.
    fn code_of(&self, error: &NodeError) -> u8 {
        match (self, error) {
            (
                Self::Info(_) | Self::Verify { .. } | Self::Convert(_) | Self::Recover(_),
                NodeError::Runtime(_),
            ) => 2,
            _ => error.code(),
        }
    }
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
    let command = Arguments::parse().command;
    if let Err(error) = let_long_files_fail() {
        return fail(&command, &NodeError::runtime(error));
    }
    let outcome = match &command {
        Command::Run(options) => run::run(options),
        Command::Explain(options) => explain::explain(options),
        Command::Info(options) => info::info(options),
        Command::Verify { bag, flight, json } => verify::verify(bag, flight.as_deref(), *json),
        Command::Convert(options) => convert::convert(options),
        Command::Recover(options) => recover::recover(options),
        Command::Plot {
            bag,
            flight,
            output,
        } => plot::plot(bag, flight.as_deref(), output.as_deref())
            .and_then(|picture| output::say(&picture.display()))
            .map(|()| ExitCode::SUCCESS),
        Command::Ensemble(command) => ensemble::ensemble(command),
        Command::Record(options) => return record::record(options),
        Command::Play(options) => return play::play(options),
        Command::Node { node, arguments } => return node.run(arguments.clone()),
    };
    outcome.unwrap_or_else(|error| fail(&command, &error))
}

/// Says why there is no result: on standard error, and as JSON where that was asked for.
fn fail(command: &Command, error: &NodeError) -> ExitCode {
    let exit_code = command.code_of(error);
    if command.prints_json() {
        output::fail(error, exit_code);
    }
    complain(&format_args!("lgvi: {error}"));
    ExitCode::from(exit_code)
}
