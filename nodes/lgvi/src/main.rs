//! `lgvi`: the front door to the node suite.
mod bars;
mod beside;
mod choosing;
mod chosen;
mod convert;
mod drawn;
mod ensemble;
mod explain;
mod files;
mod info;
mod new;
mod node_command;
mod output;
mod parameters;
mod play;
mod plot;
mod record;
mod recover;
mod report;
mod run;
mod scene_input;
mod strictness;
mod sweep;
mod values;
mod verify;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand, ValueEnum};
use lgvi_middleware::node::{NodeError, complain, let_long_files_fail};

/// Fly rigid bodies in ROS 2: plan, propagate, record, replay, verify.
#[derive(Parser)]
#[command(version, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Fly a scene: plan, propagate and record it.
    ///
    /// Exit codes: 0 success; 1 the flight failed or messages were lost; 2 the scene cannot be used; 3 there were warnings
    /// and `--strict` was given; 130 the flight was interrupted.
    Run(run::Options),
    /// Show a scene's bodies, integrator and maneuver, with warnings.
    ///
    /// Exit codes: 0 the scene can be flown; 2 it cannot be used; 3 there are warnings and `--strict` was given.
    Explain(explain::Options),
    /// Show a bag's files, topics, times and losses.
    ///
    /// Reads only the summaries of the files; `--check` reads everything. Exit codes: 0 the bag is complete; 1 only a part
    /// can be read; 2 the bag cannot be read.
    Info(info::Options),
    /// Fly a recorded scene again and compare every state bit for bit.
    ///
    /// Uses the scene and the controls in the bag. Exit codes: 0 all recorded states agree (the output says if the flight
    /// was interrupted); 1 a state differs; 2 the bag cannot be verified.
    Verify {
        /// Directory of the bag, or one MCAP file.
        #[arg(value_parser = values::path())]
        bag: PathBuf,
        /// Node name of the propagator, such as `/lgvi_propagator`, if the bag has flights of several.
        #[arg(long, value_name = "NAME")]
        flight: Option<String>,
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Convert a bag's topics to CSV or Parquet files, one file per topic.
    ///
    /// Reads any rosbag2 bag of MCAP files. Exit codes: 0 success; 1 a topic was left out (the output says why); 2 the bag
    /// cannot be read.
    Convert(convert::Options),
    /// Recover the readable part of a damaged bag into a new one.
    ///
    /// A killed recorder or a full disk leaves such a bag. Exit codes: 0 only the unwritten end is missing; 1 something was
    /// left out, or messages are missing by the bag's own counts; 2 nothing could be recovered.
    Recover(recover::Options),
    /// Draw a recorded flight: motion, controls, energy and momentum.
    ///
    /// Overwrites `flight.svg` in the bag's directory, but never another existing file.
    Plot {
        /// Directory of the bag, or one MCAP file.
        #[arg(value_parser = values::path())]
        bag: PathBuf,
        /// Node name of the propagator, such as `/lgvi_propagator`, if the bag has flights of several.
        #[arg(long, value_name = "NAME")]
        flight: Option<String>,
        /// SVG file to write (default: `flight.svg` in the bag's directory).
        #[arg(long, value_parser = values::path())]
        output: Option<PathBuf>,
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Write an interactive HTML page of a recorded flight: 3D view and linked plots.
    ///
    /// The page is one file that opens in any browser with WebGL and needs no network. Overwrites `report.html` in the bag's
    /// directory, but never another existing file.
    Report(report::Options),
    /// Fly many dispersed samples of a scene (Monte Carlo), or merge results.
    ///
    /// Exit codes: 0 all requested samples are there (the output says how many failed); 1 the run was interrupted or results
    /// could not be written; 2 the scene or the existing results cannot be used.
    #[command(subcommand)]
    Ensemble(ensemble::Command),
    /// Write a scene file from a template.
    New(new::Options),
    /// Print the JSON Schema of scene files, for editors.
    ///
    /// With `#:schema scene.schema.json` in the first line of a scene, a TOML language server such as taplo completes and
    /// checks it.
    Schema,
    /// Record topics from shared memory and DDS until stopped.
    Record(record::Options),
    /// Fly a scene with every combination of some values, into one table and one picture.
    ///
    /// Flies in this process, without nodes. Exit codes: 0 all combinations are in the table, also those that failed; 2 a
    /// combination is no scene; 130 it was interrupted.
    Sweep(sweep::Options),
    /// Replay a bag over shared memory and DDS.
    Play(play::Options),
    /// Run one node of the suite with its own ROS 2 arguments.
    Node {
        /// Node to run.
        node: NodeKind,
        /// The node's arguments, such as `--ros-args -p scene:=scenes/free_body.toml`.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
    /// Print a completion script for a shell.
    Completions {
        /// Shell.
        shell: clap_complete::Shell,
    },
    /// Write man pages.
    Man {
        /// Directory for the pages; it is made if there is none.
        #[arg(value_parser = values::path())]
        directory: PathBuf,
    },
}

impl Command {
    /// Whether the output is JSON.
    fn prints_json(&self) -> bool {
        match self {
            Self::Run(options) => options.json,
            Self::Info(options) => options.json,
            Self::Convert(options) => options.json,
            Self::Recover(options) => options.json,
            Self::Report(options) => options.json,
            Self::Ensemble(command) => command.prints_json(),
            Self::Explain(options) => options.json,
            Self::Verify { json, .. } => *json,
            Self::Plot { json, .. } => *json,
            Self::New(options) => options.json,
            Self::Record(options) => options.json,
            Self::Sweep(options) => options.json,
            Self::Play(options) => options.json,
            Self::Schema | Self::Node { .. } | Self::Completions { .. } | Self::Man { .. } => false,
        }
    }

    /// The exit code of a failure; 2 for commands that use 1 for a finding.
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
    /// The name on the command line and in messages.
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
    if let Some((node, arguments)) = node_help() {
        return node.run(arguments);
    }
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
            json,
        } => plot::plot(bag, flight.as_deref(), output.as_deref())
            .and_then(|picture| {
                if *json {
                    output::say(&serde_json::json!({"bag": bag, "picture": picture}))
                } else {
                    output::say(&picture.display())
                }
            })
            .map(|()| ExitCode::SUCCESS),
        Command::Report(options) => report::report(options),
        Command::Ensemble(command) => ensemble::ensemble(command),
        Command::Sweep(options) => sweep::sweep(options),
        Command::Record(options) => return record::record(options),
        Command::Play(options) => play::play(options),
        Command::Node { node, arguments } => return node.run(arguments.clone()),
        Command::New(options) => new::new(options),
        Command::Schema => output::say(&lgvi_scene::SCHEMA.trim_end()).map(|()| ExitCode::SUCCESS),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut Arguments::command(), "lgvi", &mut script);
            output::say(&String::from_utf8_lossy(&script).trim_end()).map(|()| ExitCode::SUCCESS)
        }
        Command::Man { directory } => std::fs::create_dir_all(directory)
            .and_then(|()| clap_mangen::generate_to(Arguments::command(), directory))
            .map(|()| ExitCode::SUCCESS)
            .map_err(|error| NodeError::Input(format!("{}: {error}", directory.display()))),
    };
    outcome.unwrap_or_else(|error| fail(&command, &error))
}

/// A node whose own help is asked for: `lgvi node <NODE> --help`.
fn node_help() -> Option<(NodeKind, Vec<String>)> {
    let arguments = std::env::args_os().skip(1);
    let mut arguments = arguments.map_while(|argument| argument.into_string().ok());
    if arguments.next()? != "node" {
        return None;
    }
    let node = NodeKind::from_str(&arguments.next()?, false).ok()?;
    let rest: Vec<_> = arguments.collect();
    let first = rest.first()?;
    (first == "--help" || first == "-h").then_some((node, rest))
}

/// Reports an error: on standard error, and as JSON with `--json`.
fn fail(command: &Command, error: &NodeError) -> ExitCode {
    let exit_code = command.code_of(error);
    if command.prints_json() {
        output::fail(error, exit_code);
    }
    complain(&format_args!("lgvi: {error}"));
    ExitCode::from(exit_code)
}
