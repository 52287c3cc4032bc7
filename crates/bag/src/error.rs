//! What can be wrong with bags.

use std::{
    collections::BTreeMap,
    fmt::Debug,
    io,
    path::{Path, PathBuf},
};

use mcap::McapError;
use thiserror::Error;

/// Why a bag cannot be written.
#[derive(Debug, Error)]
pub enum WriteError {
    /// Bags are never overwritten.
    #[error("{path}: exists and is not an empty directory", path = .0.display())]
    Exists(PathBuf),
    /// The bag's file is named after its directory.
    #[error("{path}: has no name in UTF-8, from which the bag's file could take its own", path = .0.display())]
    NoName(PathBuf),
    /// A topic or a message that the bag cannot take, and why. The bag goes on without it.
    #[error("{0}")]
    Refused(String),
    /// An operation on a file or directory failed.
    #[error("{path}: {1}", path = .0.display())]
    Io(PathBuf, #[source] io::Error),
    /// A bag that was being written could not be written on.
    #[error("{path}: {source}; {rest}", path = .path.display())]
    Failed {
        /// File or directory.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
        /// What is left of the bag.
        rest: Rest,
    },
    /// The bag was closed after an earlier error.
    #[error("{path}: takes no more messages after an earlier error", path = .0.display())]
    Ended(PathBuf),
}

impl WriteError {
    /// For what the system says of `path`.
    pub(crate) fn io(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::Io(path.to_owned(), source)
    }
}

/// What is left of a bag that could not be written on.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Rest {
    /// A complete bag of what was written before.
    #[error("the bag is closed without the last {lost} messages")]
    Closed {
        /// Messages that are in it, by topic, each counted once.
        messages: BTreeMap<String, u64>,
        /// Messages that are not: those taken, and those that the writer was told of
        /// ([`BagWriter::on_failure`](crate::BagWriter::on_failure)).
        lost: u64,
    },
    /// A bag without its end.
    #[error(
        "the bag could not be closed: what was written, all but the last {lost} messages, can be got back with lgvi recover \
         {bag}",
        bag = .bag.display()
    )]
    Unclosed {
        /// The bag's directory.
        bag: PathBuf,
        /// Messages that are not in it, counted as for a closed one.
        lost: u64,
    },
    /// Nothing where it was: it was deleted or moved.
    #[error("the bag has been deleted or moved while it was written")]
    Gone,
}

/// Why a bag cannot be read.
#[derive(Debug, Error)]
pub enum BagError {
    /// An operation on a file or directory failed.
    #[error("{path}: {words}", path = .0.display(), words = words(.1))]
    Io(PathBuf, #[source] io::Error),
    /// It is no bag, or not of a kind that is read, or its parts do not fit together: the value found and the one expected.
    #[error("{path}: {1}", path = .0.display())]
    Invalid(PathBuf, String),
    /// The bag is stored in another format than MCAP.
    #[error(
        "{file}: storage is {found:?}, expected \"mcap\"; convert the bag: {tool}",
        file = .file.display(),
        tool = if found.starts_with("ROS 1") { "rosbags-convert (PyPI rosbags)" } else {
            "ros2 bag convert -i <bag> -o <options.yaml> with storage_id: mcap"
        }
    )]
    Storage {
        /// The metadata file, or the file of the other storage.
        file: PathBuf,
        /// The storage found, as `sqlite3`.
        found: String,
    },
    /// Its files or messages are compressed in a way that is not read here.
    #[error(
        "{file}: compression is {mode} with {format:?}, expected none or one of messages with zstd; unpack the files first",
        file = .file.display()
    )]
    Compressed {
        /// The metadata file.
        file: PathBuf,
        /// What is compressed, as `FILE`.
        mode: String,
        /// How, as `zstd`.
        format: String,
    },
    /// Bytes of the file are damaged, or it ends before its end: the recorder was killed, or the file cut off.
    #[error("{file}: damaged at byte {offset} or after it: {source}", file = .file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// Where the damaged section or chunk starts.
        offset: u64,
        /// What is wrong.
        source: Damage,
    },
}

impl BagError {
    /// For what the system says of `path`.
    pub(crate) fn io(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::Io(path.to_owned(), source)
    }

    pub(crate) fn invalid(path: &Path, reason: impl Into<String>) -> Self {
        Self::Invalid(path.to_owned(), reason.into())
    }
}

/// What the system says, without the number of its error.
fn words(error: &io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or_default().into()
}

/// What is wrong with bytes of an MCAP file: the value found and the one expected.
#[derive(Debug, Error)]
#[error("{0}")]
pub struct Damage(pub(crate) String);

impl From<McapError> for Damage {
    fn from(error: McapError) -> Self {
        Self(format!("cannot be read: {error}"))
    }
}

impl Damage {
    /// The definition of an id is not in the file before it is needed.
    pub(crate) fn undefined(record: &str, id: u16) -> Self {
        Self(format!("{record} {id} is not in the file"))
    }
}

/// Compares a value that a record tells with the one found.
pub(crate) fn agree<T: PartialEq + Debug>(what: &str, told: T, found: T) -> Result<(), Damage> {
    match told == found {
        true => Ok(()),
        false => Err(Damage(format!("{what}: {told:?}, found {found:?}"))),
    }
}

/// Checks the length of a record that is read into memory.
pub(crate) fn limited(opcode: u8, length: u64, limit: usize) -> Result<usize, Damage> {
    let fits = usize::try_from(length).ok();
    fits.filter(|length| *length <= limit).ok_or_else(|| {
        let limit = format!("expected at most {limit}");
        Damage(format!(
            "record {opcode:#04x} is of {length} bytes, {limit}"
        ))
    })
}

/// Why a bag cannot be recovered.
#[derive(Debug, Error)]
pub enum RecoverError {
    /// The damaged bag cannot be read, or is of a kind that is not recovered.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// A writer has the bag open.
    #[error("{file}: is being written, expected a bag whose recorder has ended", file = .0.display())]
    BeingWritten(PathBuf),
    /// No message can be read, of a bag that had some.
    #[error("{bag}: nothing is readable of {bytes} bytes{what}", bag = .bag.display())]
    Nothing {
        /// The bag.
        bag: PathBuf,
        /// Bytes of its files.
        bytes: u64,
        /// What is known of it: the first place that was left out, and how many messages are missing.
        what: String,
    },
    /// The new bag cannot be written; the damaged one is as it was.
    #[error(transparent)]
    Write(WriteError),
}

impl RecoverError {
    /// For what writing `path` gives.
    pub(crate) fn write(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::Write(WriteError::io(path)(source))
    }
}

impl From<WriteError> for RecoverError {
    fn from(error: WriteError) -> Self {
        Self::Write(match error {
            // What is left of a new bag that is incomplete is removed.
            WriteError::Failed { path, source, .. } => WriteError::Io(path, source),
            error => error,
        })
    }
}
