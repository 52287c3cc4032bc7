//! `lgvi ensemble`: a scene flown many times over.

mod merge;
mod report;
mod run;

use std::process::ExitCode;

use clap::Subcommand;
use lgvi_ensemble::EnsembleError;
use lgvi_middleware::node::NodeError;

/// The commands of `lgvi ensemble`.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Fly the samples of a scene's `ensemble` table and summarize them.
    ///
    /// The results are Parquet files, a summary and histograms. An interrupted run continues if it is started again with
    /// the same output directory.
    Run(run::Options),
    /// Merge the results of several hosts; the merged files equal those of one run, byte for byte.
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

/// The exit code: 1 if the machine failed, 2 if the input cannot be used.
fn failed(error: EnsembleError) -> NodeError {
    if error.is_io() {
        NodeError::runtime(error)
    } else {
        NodeError::input(error)
    }
}
