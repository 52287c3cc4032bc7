use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};

use lgvi_scene::SchemeError;
use thiserror::Error;

/// The reason that an ensemble cannot be created, flown or read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EnsembleError {
    /// The scene does not define deviations of samples.
    #[error("the scene has no `ensemble` table, expected one with `samples` and `seed`")]
    NoTable,
    /// The ensemble is empty or too large.
    #[error("{0} samples, expected 1 to 9999999999")]
    Samples(u64),
    /// Samples outside the ensemble were requested.
    #[error("samples {}..{} were requested, expected a non-empty part of 0..{samples}", range.start, range.end)]
    Range {
        /// The requested samples.
        range: Range<u64>,
        /// Number of samples of the ensemble.
        samples: u64,
    },
    /// A maneuver without a plan, or a plan without a maneuver.
    #[error("expected commands exactly if the scene has a maneuver")]
    Commands,
    /// Commands of other actuators than those of the maneuver.
    #[error("commands of other actuators, expected {}", match .0 {
        0 => "force and moment".into(),
        count => format!("those of the {count} thrusters or wheels that the maneuver commands"),
    })]
    Actuators(usize),
    /// The scene has no integrator.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// A file or directory cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// The underlying error.
        source: std::io::Error,
    },
    /// The file of a part is damaged.
    #[error("{}: {reason}; without that file its samples can be flown again", path.display())]
    Damaged {
        /// The file of the part.
        path: PathBuf,
        /// A description of the damage.
        reason: String,
    },
    /// The part belongs to another ensemble.
    #[error("{}: {what} is {found}, expected {expected}", path.display())]
    Foreign {
        /// The file of the part.
        path: PathBuf,
        /// The property that differs.
        what: &'static str,
        /// The value in the part.
        found: String,
        /// The expected value.
        expected: String,
    },
    /// A part with other boundaries, beside which samples are missing.
    #[error(
        "{}: only a part of the samples that fly together; fly {}..{} by `--range` too, or all elsewhere",
        path.display(), missing.start, missing.end
    )]
    Cut {
        /// The file of the part.
        path: PathBuf,
        /// The first missing samples.
        missing: Range<u64>,
    },
    /// Two parts have samples in common.
    #[error("{} and {} overlap", first.display(), second.display())]
    Overlap {
        /// The file of one part.
        first: PathBuf,
        /// The file of the other part.
        second: PathBuf,
    },
    /// Samples that have not been flown.
    #[error("samples {}..{} are missing", range.start, range.end)]
    Gap {
        /// The first missing samples.
        range: Range<u64>,
    },
    /// A directory without parts.
    #[error("{}: no parts of an ensemble", path.display())]
    Nothing {
        /// The directory.
        path: PathBuf,
    },
    /// The path or URL of a place names none.
    #[error("{place}: {reason}")]
    Place {
        /// The path or URL.
        place: String,
        /// The reason.
        reason: String,
    },
    /// A file in place of a directory.
    #[error("{}: no directory", path.display())]
    NotDirectory {
        /// Its path.
        path: PathBuf,
    },
    /// The directory to be created exists already and is not empty.
    #[error("{}: is not empty, expected a new or empty directory", path.display())]
    Occupied {
        /// The directory.
        path: PathBuf,
    },
    /// A picture cannot be drawn.
    #[error("no picture of the summary: {0}")]
    Picture(String),
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

    pub(crate) fn place(place: &str, reason: impl ToString) -> Self {
        Self::Place {
            place: place.into(),
            reason: reason.to_string(),
        }
    }

    /// Returns true if the machine failed, as opposed to the input being invalid.
    pub fn is_io(&self) -> bool {
        matches!(self, Self::Io { .. } | Self::Picture(_))
    }
}
