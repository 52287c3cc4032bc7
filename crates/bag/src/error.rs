use std::{
    collections::BTreeMap,
    fmt::Display,
    io,
    path::{Path, PathBuf},
};

use thiserror::Error;

use crate::Damage;

/// Why a bag cannot be written.
#[derive(Debug, Error)]
pub enum WriteError {
    /// Bags are never overwritten.
    #[error("{path}: exists and is not an empty directory", path = .path.display())]
    Exists {
        /// Where the bag was to be made.
        path: PathBuf,
    },
    /// The bag's file is named after its directory.
    #[error("{path}: has no name in UTF-8, from which the bag's file could take its own", path = .path.display())]
    NoName {
        /// Where the bag was to be made.
        path: PathBuf,
    },
    /// A topic of this name but another type is already in the bag.
    #[error("topic {topic} has type {existing}, cannot also have {requested}")]
    ConflictingType {
        /// The topic's name.
        topic: String,
        /// Type and hash in the bag.
        existing: String,
        /// Type and hash that were to be added.
        requested: String,
    },
    /// The id comes from another bag.
    #[error("topic id {index} is not of this bag, which has {count} topics")]
    UnknownTopic {
        /// Number behind the id.
        index: usize,
        /// Topics of the bag.
        count: usize,
    },
    /// A message is longer than any that is read. The bag goes on without it.
    #[error("a message of {topic} has {length} bytes, expected at most {limit}")]
    TooLong {
        /// The topic.
        topic: String,
        /// The message's length (bytes).
        length: usize,
        /// The longest that is written.
        limit: usize,
    },
    /// A file operation failed.
    #[error("{path}: {source}", path = .path.display())]
    Io {
        /// File or directory.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
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
    #[error("{path}: takes no more messages after an earlier error", path = .path.display())]
    Ended {
        /// The bag's directory.
        path: PathBuf,
    },
    /// MCAP numbers topics with 16 bits.
    #[error("topic {topic}: a bag has at most 65535 topics")]
    TooManyTopics {
        /// The topic that was to be added.
        topic: String,
    },
    /// Metadata could not be rendered.
    #[error("cannot render bag metadata: {0}")]
    Yaml(#[from] serde_yaml_ng::Error),
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

/// What the system says, without the number of its error.
fn words(error: &io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or_default().into()
}

/// Why a bag cannot be read.
#[derive(Debug, Error)]
pub enum BagError {
    /// A file operation failed.
    #[error("{path}: {words}", path = .path.display(), words = words(source))]
    Io {
        /// File or directory.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A directory that is no bag.
    #[error("{path}: no .mcap file, expected metadata.yaml and the files that it lists, or .mcap files", path = .path.display())]
    NoBag {
        /// The directory.
        path: PathBuf,
    },
    /// `metadata.yaml` is not what rosbag2 writes.
    #[error("{file}: {source}", file = .file.display())]
    Metadata {
        /// The metadata file.
        file: PathBuf,
        /// Field and place of the fault.
        source: serde_yaml_ng::Error,
    },
    /// The bag is not of a kind that is read.
    #[error("{file}: {field} is {found}, expected {expected}", file = .file.display())]
    Unexpected {
        /// The metadata file, or an MCAP file.
        file: PathBuf,
        /// What is not as expected.
        field: &'static str,
        /// What it is.
        found: String,
        /// What it should be.
        expected: String,
    },
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
    /// A file of a bag without `metadata.yaml` is not there.
    #[error("{file}: is not there, though the bag has files with a number before and after it", file = .file.display())]
    Missing {
        /// The file.
        file: PathBuf,
    },
    /// Too many messages would have to be in memory to bring them into the order of their log times.
    #[error("{file}: chunks that overlap in time hold more than {limit} bytes; sort the file: mcap sort", file = .file.display())]
    Overlap {
        /// The file.
        file: PathBuf,
        /// Bytes that are held at most.
        limit: usize,
    },
    /// `metadata.yaml` and the MCAP files disagree: messages were lost, or belong to another bag.
    #[error(
        "{file}: message_count{of} is {expected}, but the bag's files hold {found}",
        file = .file.display(),
        of = .topic.as_ref().map_or_else(String::new, |topic| format!(" of {topic}"))
    )]
    Count {
        /// The metadata file.
        file: PathBuf,
        /// The topic; none for all together.
        topic: Option<String>,
        /// Messages by the metadata.
        expected: u64,
        /// Messages by the files.
        found: u64,
    },
    /// An MCAP file in the bag's directory is not of the bag.
    #[error("{file}: is not listed in metadata.yaml, and not read", file = .file.display())]
    Unlisted {
        /// The file.
        file: PathBuf,
    },
    /// The file ends before its end: the recorder was killed, or the file cut off.
    #[error(
        "{file}: truncated: expected {expected} at byte {offset} of {size}, found {found:02x?}; what is readable: lgvi recover",
        file = .file.display()
    )]
    Truncated {
        /// The file.
        file: PathBuf,
        /// What should be there.
        expected: &'static str,
        /// Where it should be.
        offset: u64,
        /// Bytes found there.
        found: Vec<u8>,
        /// The file's size.
        size: u64,
    },
    /// A topic's quality of service is not what rosbag2 writes; ROS 2's default is taken.
    #[error("{file}: {field} of {topic}: {source}; the default is used", file = .file.display(), field = crate::channel_key::QOS)]
    Qos {
        /// The file.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// Field and place of the fault.
        source: serde_yaml_ng::Error,
    },
    /// Bytes of the file are damaged.
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
        move |source| Self::Io {
            path: path.to_owned(),
            source,
        }
    }

    pub(crate) fn unexpected(
        file: &Path,
        field: &'static str,
        found: impl Display,
        expected: impl Display,
    ) -> Self {
        Self::Unexpected {
            file: file.to_owned(),
            field,
            found: found.to_string(),
            expected: expected.to_string(),
        }
    }
}

impl WriteError {
    /// For what the system says of `path`.
    pub(crate) fn io(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::Io {
            path: path.to_owned(),
            source,
        }
    }
}
