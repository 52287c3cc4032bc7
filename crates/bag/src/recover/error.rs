use std::{
    io,
    path::{Path, PathBuf},
};

use thiserror::Error;

use crate::{BagError, WriteError};

/// Why a bag cannot be recovered.
#[derive(Debug, Error)]
pub enum RecoverError {
    /// The damaged bag cannot be read, or is of a kind that is not recovered.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// A writer has the bag open.
    #[error("{file}: is being written, expected a bag whose recorder has ended", file = .file.display())]
    BeingWritten {
        /// The file that is being written.
        file: PathBuf,
    },
    /// No message can be read, of a bag that had some.
    #[error("{bag}: nothing is readable of {bytes} bytes{what}", bag = .bag.display(), what = what(*missing, reason))]
    Nothing {
        /// The bag.
        bag: PathBuf,
        /// Bytes of its files.
        bytes: u64,
        /// Number of messages that it had, if that is known.
        missing: Option<u64>,
        /// What is wrong with the first place that was left out, if any was.
        reason: Option<String>,
    },
    /// The new bag cannot be written; the damaged one is as it was.
    #[error(transparent)]
    Write(WriteError),
}

impl RecoverError {
    /// For what writing `path` gives.
    pub(super) fn write(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::Write(WriteError::io(path)(source))
    }
}

impl From<WriteError> for RecoverError {
    fn from(error: WriteError) -> Self {
        Self::Write(match error {
            // What is left of a new bag that is incomplete is removed.
            WriteError::Failed { path, source, .. } => WriteError::Io { path, source },
            error => error,
        })
    }
}

/// What is known of a bag of which nothing is readable.
fn what(missing: Option<u64>, reason: &Option<String>) -> String {
    let missing = missing.map(|missing| format!("; {missing} messages are missing"));
    let reason = reason.as_ref().map(|reason| format!(": {reason}"));
    reason.unwrap_or_default() + &missing.unwrap_or_default()
}
