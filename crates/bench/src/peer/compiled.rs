//! Peers in C++.

use std::process::Command;

use tempfile::{NamedTempFile, TempPath};

use crate::error::BenchError;

/// The program of a source file, compiled by g++ with these flags; it is removed when it is dropped.
pub(crate) fn compiled(source: &str, flags: &[&str]) -> Result<TempPath, BenchError> {
    let refuse = |error: &dyn std::fmt::Display| BenchError::Peer(format!("g++: {error}"));
    let file = NamedTempFile::new().map_err(|error| refuse(&error))?;
    let program = file.into_temp_path();
    let compiled = Command::new("g++")
        .args(flags)
        .args([source, "-o"])
        .arg(&program)
        .status()
        .map_err(|error| refuse(&error))?;
    match compiled.success() {
        true => Ok(program),
        false => Err(refuse(&compiled)),
    }
}
