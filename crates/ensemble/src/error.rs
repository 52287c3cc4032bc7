use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};

use lgvi_scene::SchemeError;
use thiserror::Error;

/// Why there is no ensemble, or no more of it.
#[derive(Debug, Error)]
pub enum EnsembleError {
    /// The scene does not say what samples differ in.
    #[error("the scene has no `ensemble` table, expected one with `samples` and `seed`")]
    NoTable,
    /// An empty ensemble, or one too large.
    #[error("{0} samples, expected 1 to 10000000")]
    Samples(u64),
    /// Samples that are not there.
    #[error("samples {}..{} are asked for, expected a part of 0..{samples} that is not empty", range.start, range.end)]
    Range {
        /// What is asked for.
        range: Range<u64>,
        /// Samples of the ensemble.
        samples: u64,
    },
    /// A maneuver without a plan, or a plan without a maneuver.
    #[error("commands for a scene without a maneuver, or none for one with")]
    Commands,
    /// The scene has no integrator.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// A file or directory cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A part that is no part.
    #[error("{}: {reason}; without that file its samples can be flown again", path.display())]
    Damaged {
        /// Its file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A part of another ensemble.
    #[error("{}: {what} is {found}, expected {expected}", path.display())]
    Foreign {
        /// Its file.
        path: PathBuf,
        /// In what it differs.
        what: &'static str,
        /// What it says.
        found: String,
        /// What was expected.
        expected: String,
    },
    /// A part that is cut otherwise, with samples missing beside it.
    #[error(
        "{}: only a part of the samples that fly together; fly {}..{} by `--range` too, or all elsewhere",
        path.display(), missing.start, missing.end
    )]
    Cut {
        /// Its file.
        path: PathBuf,
        /// The first samples that are missing.
        missing: Range<u64>,
    },
    /// Parts that have samples in common.
    #[error("{} and {} overlap", first.display(), second.display())]
    Overlap {
        /// One of them.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// Samples that nobody flew.
    #[error("samples {}..{} are missing", range.start, range.end)]
    Gap {
        /// The first that are.
        range: Range<u64>,
    },
    /// No parts at all.
    #[error("{}: no parts of an ensemble", path.display())]
    Nothing {
        /// Where they were looked for.
        path: PathBuf,
    },
    /// A file where a directory should be.
    #[error("{}: no directory", path.display())]
    NotDirectory {
        /// Which.
        path: PathBuf,
    },
    /// A directory to be made is there and has something in it.
    #[error("{}: not empty, expected a directory to be made", path.display())]
    Occupied {
        /// Which.
        path: PathBuf,
    },
    /// A picture cannot be drawn.
    #[error("{}: {reason}", path.display())]
    Picture {
        /// Its file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

impl EnsembleError {
    pub(crate) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |source| match source.kind() {
            ErrorKind::NotADirectory => Self::NotDirectory { path: path.into() },
            _ => Self::Io {
                path: path.into(),
                source,
            },
        }
    }

    pub(crate) fn damaged(path: &Path, reason: impl ToString) -> Self {
        Self::Damaged {
            path: path.into(),
            reason: reason.to_string(),
        }
    }

    /// Whether it was the machine that failed, not what it was given.
    pub fn is_io(&self) -> bool {
        matches!(self, Self::Io { .. } | Self::Picture { .. })
    }
}
