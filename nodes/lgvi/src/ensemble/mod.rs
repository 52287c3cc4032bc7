//! `lgvi ensemble`: a scene flown many times over.

mod merge;
mod report;
mod run;

use std::process::ExitCode;

use clap::Subcommand;
use lgvi_ensemble::EnsembleError;
use lgvi_node::NodeError;

/// What `lgvi ensemble` does.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Flies the samples of a scene's `ensemble` table and says what they come to.
    ///
    /// Results are parts in Parquet, a summary and histograms. What an ended run has left is gone on from when it is started
    /// again with the same output.
    Run(run::Options),
    /// Joins the parts of runs on other hosts, byte by byte to those of a run that was not cut.
    Merge(merge::Options),
}

impl Command {
    pub(crate) fn prints_json(&self) -> bool {
        match self {
            Self::Run(options) => options.json,
            Self::Merge(options) => options.json,
        }
    }
}

pub(crate) fn ensemble(command: &Command) -> Result<ExitCode, NodeError> {
    match command {
        Command::Run(options) => run::run(options),
        Command::Merge(options) => merge::merge(options),
    }
}

/// By what failed: the machine, or what it was given.
fn failed(error: EnsembleError) -> NodeError {
    if error.is_io() {
        NodeError::runtime(error)
    } else {
        NodeError::input(error)
    }
}
