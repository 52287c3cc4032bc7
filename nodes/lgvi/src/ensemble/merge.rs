use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use lgvi_ensemble::{MergeOptions, merge as join};
use lgvi_node::NodeError;

use super::failed;
use super::report::report;
use crate::output::say;
use crate::values;

/// The command line of `lgvi ensemble merge`.
#[derive(Args)]
pub(crate) struct Options {
    /// The directories with the parts.
    #[arg(required = true, value_parser = values::path())]
    directories: Vec<PathBuf>,
    /// The directory to make; empty if it is there.
    #[arg(long, value_name = "DIRECTORY", value_parser = values::path())]
    output: PathBuf,
    /// Join what is there, though samples are missing.
    #[arg(long)]
    allow_gaps: bool,
    /// Print the summary as one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Joins parts and says what they come to.
pub(crate) fn merge(options: &Options) -> Result<ExitCode, NodeError> {
    let allowed = MergeOptions {
        allow_gaps: options.allow_gaps,
    };
    let (store, merged) = join(&options.directories, &options.output, allowed).map_err(failed)?;
    let remarks = match merged.missing {
        0 => Vec::new(),
        missing => vec![format!("{missing} samples are missing")],
    };
    if !options.json {
        remarks.iter().try_for_each(|remark| say(remark))?;
    }
    report(&store, options.json, &remarks)?;
    Ok(ExitCode::SUCCESS)
}
