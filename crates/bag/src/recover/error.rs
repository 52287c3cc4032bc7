use std::{
    io,
    path::{Path, PathBuf},
};

use mcap::McapError;
use thiserror::Error;

use crate::{BagError, WriteError};

/// Why a bag cannot be recovered.
#[derive(Debug, Error)]
pub enum RecoverError {
    /// A file of the damaged bag cannot be read.
    #[error("{path}: {source}", path = .path.display())]
    Read {
        /// File or directory.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A directory without any MCAP file.
    #[error("{path}: found no .mcap file, expected a bag", path = .path.display())]
    NoBag {
        /// The directory.
        path: PathBuf,
    },
    /// A writer has the bag open.
    #[error("{file}: is being written, expected a bag whose recorder has ended", file = .file.display())]
    BeingWritten {
        /// The file that is being written.
        file: PathBuf,
    },
    /// Nothing in the file is of MCAP.
    #[error("{file}: holds no MCAP record, expected an MCAP file", file = .file.display())]
    NotMcap {
        /// The file.
        file: PathBuf,
        /// Its first bytes.
        found: Vec<u8>,
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
    /// The bag is of a kind that is not recovered.
    #[error(transparent)]
    Kind(BagError),
    /// The new bag cannot be written; the damaged one is as it was.
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl RecoverError {
    /// For what reading `path` gives.
    pub(super) fn read(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::Read {
            path: path.to_owned(),
            source,
        }
    }

    /// For what writing `path` gives.
    pub(super) fn write(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| {
            Self::Write(WriteError::Io {
                path: path.to_owned(),
                source,
            })
        }
    }

    /// For what writing the MCAP file `path` gives.
    pub(super) fn mcap(path: &Path) -> impl Fn(McapError) -> Self {
        move |source| {
            Self::write(path)(match source {
                McapError::Io(source) => source,
                other => io::Error::other(other),
            })
        }
    }
}

/// What is known of a bag of which nothing is readable.
fn what(missing: Option<u64>, reason: &Option<String>) -> String {
    let missing = missing.map(|missing| format!("; {missing} messages are missing"));
    let reason = reason.as_ref().map(|reason| format!(": {reason}"));
    reason.unwrap_or_default() + &missing.unwrap_or_default()
}
