//! Compares instruction counts of the hot kernels, taken by callgrind, with those kept in the repository.

#![allow(clippy::print_stdout)]

mod comparison;
mod counts;
mod kernels;
mod measured;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use thiserror::Error;

use comparison::Comparison;
use counts::Counts;

/// Where the counts are kept.
const KEPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/instructions.toml");

/// Counts the instructions of the hot kernels and compares them with those that are kept. Needs valgrind.
#[derive(Parser)]
struct Arguments {
    /// Only run this kernel.
    #[arg(long, value_name = "KERNEL", hide = true)]
    run: Option<String>,
    /// Keep these counts from now on.
    #[arg(long)]
    update: bool,
    /// File of the counts that are kept.
    #[arg(long, default_value = KEPT)]
    kept: PathBuf,
}

/// Why counts cannot be compared.
#[derive(Debug, Error)]
enum GuardError {
    #[error("{path}: {source}")]
    File {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{path}: {reason}")]
    Form { path: PathBuf, reason: String },
    #[error("rustc: {0}")]
    Compiler(String),
    #[error("valgrind of {kernel}: {reason}")]
    Callgrind { kernel: String, reason: String },
    #[error("there is no kernel {0:?}")]
    Kernel(String),
}

impl GuardError {
    fn form(path: &Path, reason: impl ToString) -> Self {
        Self::Form {
            path: path.into(),
            reason: reason.to_string(),
        }
    }
}

fn main() -> Result<ExitCode, GuardError> {
    let arguments = Arguments::parse();
    if let Some(name) = arguments.run {
        let kernel = kernels::all().find(|kernel| kernel.name == name);
        kernel.ok_or(GuardError::Kernel(name))?.run();
        return Ok(ExitCode::SUCCESS);
    }
    let measured = measured::measure()?;
    if arguments.update {
        measured.write(&arguments.kept)?;
        println!("{}: {} kernels", arguments.kept.display(), measured.len());
        return Ok(ExitCode::SUCCESS);
    }
    let kept = Counts::read(&arguments.kept)?;
    let comparison = Comparison::of(&kept, &measured);
    print!("{comparison}");
    Ok(if comparison.passes() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}
