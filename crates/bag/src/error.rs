use std::{io, path::PathBuf, str::Utf8Error};

use mcap::McapError;
use thiserror::Error;

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
    /// A file operation failed.
    #[error("{path}: {source}", path = .path.display())]
    Io {
        /// File or directory.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The MCAP file could not be written on; what was flushed before stays readable.
    #[error("{path}: {source}", path = .path.display())]
    Mcap {
        /// The bag's file.
        path: PathBuf,
        /// What the MCAP writer says.
        source: McapError,
    },
    /// Metadata could not be rendered.
    #[error("cannot render bag metadata: {0}")]
    Yaml(#[from] serde_yaml_ng::Error),
}

/// Why a bag cannot be read.
#[derive(Debug, Error)]
pub enum BagError {
    /// A file operation failed.
    #[error("{path}: {source}", path = .path.display())]
    Io {
        /// File or directory.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A directory that is no bag.
    #[error("{path}: found {found} .mcap files and no metadata.yaml, expected metadata.yaml or a single .mcap file", path = .path.display())]
    NoBag {
        /// The directory.
        path: PathBuf,
        /// Number of MCAP files in it.
        found: usize,
    },
    /// `metadata.yaml` is not what rosbag2 writes.
    #[error("{file}: {source}", file = .file.display())]
    Metadata {
        /// The metadata file.
        file: PathBuf,
        /// Field and place of the fault.
        source: serde_yaml_ng::Error,
    },
    /// `metadata.yaml` has a version that this crate does not know.
    #[error("{file}: version is {found}, expected at most {newest}", file = .file.display())]
    MetadataVersion {
        /// The metadata file.
        file: PathBuf,
        /// Its version.
        found: u32,
        /// The newest version known.
        newest: u32,
    },
    /// The bag is stored in another format than MCAP.
    #[error(
        "{file}: storage_identifier is {found:?}, expected \"mcap\"; convert the bag: ros2 bag convert -i <bag> -o <options.yaml> with storage_id: mcap",
        file = .file.display()
    )]
    Storage {
        /// The metadata file.
        file: PathBuf,
        /// The storage found, as `sqlite3`.
        found: String,
    },
    /// rosbag2 compressed whole files or messages itself (MCAP's own chunk compression is read).
    #[error(
        "{file}: compression_mode is {mode:?} ({format}), expected none; convert the bag: ros2 bag convert",
        file = .file.display()
    )]
    Compressed {
        /// The metadata file.
        file: PathBuf,
        /// `FILE` or `MESSAGE`.
        mode: String,
        /// As `zstd`.
        format: String,
    },
    /// The chunks of an MCAP file are compressed in a way that this crate does not know.
    #[error("{file}: chunk compression is {found:?}, expected none or \"zstd\"; convert the file: mcap compress", file = .file.display())]
    ChunkCompression {
        /// The file.
        file: PathBuf,
        /// The compression found, as `lz4`.
        found: String,
    },
    /// `metadata.yaml` and the MCAP files disagree: messages were lost, or belong to another bag.
    #[error("{file}: message_count of {topic} is {expected}, but the bag's files hold {found}", file = .file.display())]
    Count {
        /// The metadata file.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// Messages by the metadata.
        expected: u64,
        /// Messages by the files.
        found: u64,
    },
    /// The file does not start like an MCAP file.
    #[error("{file}: starts with {found:02x?}, expected the MCAP magic {magic:02x?}", file = .file.display(), magic = mcap::MAGIC)]
    NotMcap {
        /// The file.
        file: PathBuf,
        /// Its first bytes.
        found: Vec<u8>,
    },
    /// The file ends before its end: the recorder was killed, or the file cut off.
    #[error("{file}: truncated: expected {expected} at byte {offset} of {size}, found {found:02x?}", file = .file.display())]
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
    /// The file was made without the summary from which topics and indexes are read.
    #[error("{file}: has no summary section; rebuild it: mcap recover", file = .file.display())]
    NoSummary {
        /// The file.
        file: PathBuf,
    },
    /// The MCAP file is not of ROS 2.
    #[error("{file}: profile is {found:?}, expected {expected:?}", file = .file.display())]
    Profile {
        /// The file.
        file: PathBuf,
        /// The profile found.
        found: String,
        /// The profile of ROS 2.
        expected: &'static str,
    },
    /// A topic's messages or definition are in an encoding that this crate does not know.
    #[error("{file}: {field} of {topic} is {found:?}, expected {expected:?}", file = .file.display())]
    Encoding {
        /// The file.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// What has the encoding.
        field: &'static str,
        /// The encoding found.
        found: String,
        /// The encoding known.
        expected: &'static str,
    },
    /// A topic's quality of service is not what rosbag2 writes.
    #[error("{file}: {field} of {topic}: {source}", file = .file.display(), field = crate::channel_key::QOS)]
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

/// What is wrong with bytes of an MCAP file.
#[derive(Debug, Error)]
pub enum Damage {
    /// Checksums, lengths or compressed data are wrong.
    #[error(transparent)]
    Mcap(#[from] McapError),
    /// A record ends within a field.
    #[error("{record} record: a field needs {needed} bytes, {left} are left")]
    Short {
        /// Kind of the record.
        record: &'static str,
        /// Bytes that the field needs.
        needed: usize,
        /// Bytes left in the record.
        left: usize,
    },
    /// A text is no text.
    #[error("{record} record: {source}")]
    NotUtf8 {
        /// Kind of the record.
        record: &'static str,
        /// Where it is none.
        source: Utf8Error,
    },
    /// An index points out of the part of the file it is for.
    #[error(
        "{record} record: points to {length} bytes at byte {offset}, expected to lie before byte {end}"
    )]
    OutOfRange {
        /// Kind of the record.
        record: &'static str,
        /// Where it points to.
        offset: u64,
        /// Length of what it points to.
        length: u64,
        /// End of the part of the file that it is for.
        end: u64,
    },
    /// Where an index points to is no chunk, or one of another length.
    #[error("starts with {found:02x?}, expected a chunk: {expected:02x?}")]
    NotChunk {
        /// Operation code and length of the chunk.
        expected: Vec<u8>,
        /// Bytes found instead.
        found: Vec<u8>,
    },
    /// A channel has a schema that the file does not have.
    #[error("channel {channel} has schema {schema}, which is not in the file")]
    UnknownSchema {
        /// The channel.
        channel: u16,
        /// Its schema.
        schema: u16,
    },
    /// A message has a channel that the file does not have.
    #[error("message {sequence} has channel {channel}, which is not in the summary")]
    UnknownChannel {
        /// The message's sequence number.
        sequence: u32,
        /// Its channel.
        channel: u16,
    },
}
