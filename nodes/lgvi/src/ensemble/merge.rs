use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use lgvi_ensemble::{MergeOptions, Place, merge as join};
use lgvi_middleware::node::NodeError;

use super::failed;
use super::report::report;
use crate::output::say;
use crate::values;

/// The command line of `lgvi ensemble merge`.
#[derive(Args)]
pub(crate) struct Options {
    /// Directories with the results to merge, or URLs as of `lgvi ensemble run --output`.
    #[arg(required = true, value_parser = values::path())]
    directories: Vec<PathBuf>,
    /// Directory of the merged results, new or empty.
    #[arg(long, value_name = "DIRECTORY", value_parser = values::path())]
    output: PathBuf,
    /// Merge even if samples are missing.
    #[arg(long)]
    allow_gaps: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Merges results and prints the summary.
pub(crate) fn merge(options: &Options) -> Result<ExitCode, NodeError> {
    let allowed = MergeOptions {
        allow_gaps: options.allow_gaps,
    };
    let places = options.directories.iter().map(|place| Place::at(place));
    let places = places.collect::<Result<Vec<_>, _>>().map_err(failed)?;
    let output = Place::at(&options.output).map_err(failed)?;
    if !output.is_directory() {
        let message = format!("{output}: results are merged in a directory of this machine");
        return Err(NodeError::Input(message));
    }
    let (store, merged) = join(places, &output.path(), allowed).map_err(failed)?;
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
