use std::{collections::BTreeMap, io, path::PathBuf, str::Utf8Error};

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
    #[error("{path}: no bag: expected metadata.yaml or .mcap files in it", path = .path.display())]
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
    /// A file of the bag lies, as the metadata has it, outside of the bag's directory.
    #[error("{file}: lists {listed:?}, expected a path within the bag's directory", file = .file.display())]
    Outside {
        /// The metadata file.
        file: PathBuf,
        /// The path it lists.
        listed: String,
    },
    /// A file of a bag without `metadata.yaml` is not there.
    #[error(
        "{file}: is not there, though the bag's other files tell of it{messages}",
        file = .file.display(),
        messages = .messages.map_or_else(String::new, |count| format!(": {count} messages"))
    )]
    Missing {
        /// The file.
        file: PathBuf,
        /// Its messages, those repeated at its head included, if the others tell.
        messages: Option<u64>,
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
    /// `metadata.yaml` and the MCAP files disagree in the number of all messages.
    #[error("{file}: message_count is {expected}, but the bag's files hold {found}", file = .file.display())]
    Total {
        /// The metadata file.
        file: PathBuf,
        /// Messages by the metadata.
        expected: u64,
        /// Messages by the files.
        found: u64,
    },
    /// `metadata.yaml` lists a file twice.
    #[error("{file}: lists {} twice, expected each file once", listed.display(), file = .file.display())]
    Twice {
        /// The metadata file.
        file: PathBuf,
        /// The file it lists.
        listed: PathBuf,
    },
    /// An MCAP file in the bag's directory is not of the bag.
    #[error("{file}: is not listed in metadata.yaml, and not read", file = .file.display())]
    Unlisted {
        /// The file.
        file: PathBuf,
    },
    /// The file does not start like an MCAP file.
    #[error("{file}: not an MCAP file: it starts with {found:02x?}, expected {magic:02x?}", file = .file.display(), magic = mcap::MAGIC)]
    NotMcap {
        /// The file.
        file: PathBuf,
        /// Its first bytes.
        found: Vec<u8>,
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
    /// A topic's quality of service is not what rosbag2 writes; ROS 2's default is taken.
    #[error("{file}: {field} of {topic}: {source}; taken as the default", file = .file.display(), field = crate::channel_key::QOS)]
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
    /// A checksum does not match.
    #[error("checksum of the {of} is {calculated:08x}, saved is {saved:08x}")]
    Checksum {
        /// What it is of.
        of: &'static str,
        /// What the file says.
        saved: u32,
        /// What it is.
        calculated: u32,
    },
    /// A record is longer than any that is read.
    #[error("record {opcode:#04x} is of {length} bytes, expected at most {limit}")]
    TooLong {
        /// Its operation code.
        opcode: u8,
        /// Its length.
        length: u64,
        /// The longest that is read.
        limit: usize,
    },
    /// A chunk is compressed in a way that this crate does not know.
    #[error(
        "chunk compression is {found:?}, expected none, \"lz4\" or \"zstd\"; convert the file: mcap compress"
    )]
    Compression {
        /// The compression found.
        found: String,
    },
    /// Compressed data is damaged.
    #[error("cannot be decompressed: {source}")]
    Unpack {
        /// What the decompressor says.
        source: io::Error,
    },
    /// A chunk holds another number of bytes than it says.
    #[error("chunk holds {found} bytes, expected {expected}")]
    ChunkLength {
        /// What the chunk says.
        expected: usize,
        /// What it holds.
        found: usize,
    },
    /// A file holds another number of messages than it says.
    #[error("chunks hold {found} messages, expected {expected}")]
    MessageCount {
        /// What the file says.
        expected: u64,
        /// What its chunks hold.
        found: u64,
    },
    /// A file has messages at other times than it says.
    #[error(
        "{of} are of {} ns to {} ns, the statistics of {} ns to {} ns",
        found.0, found.1, expected.0, expected.1
    )]
    Times {
        /// What is of other times.
        of: &'static str,
        /// First and last log time by the file's statistics (ns).
        expected: (u64, u64),
        /// First and last log time (ns).
        found: (u64, u64),
    },
    /// Two channels have one id.
    #[error("channel {channel} is of {first} and of {second}", first = .topics[0], second = .topics[1])]
    OtherChannel {
        /// The id.
        channel: u16,
        /// The topics of both.
        topics: [String; 2],
    },
    /// A message has a log time that its chunk index excludes.
    #[error(
        "message {sequence} is logged at {log_time} ns, its chunk is of {start} ns to {end} ns"
    )]
    OutOfTime {
        /// The message's sequence number.
        sequence: u32,
        /// Its log time (ns).
        log_time: u64,
        /// First log time of the chunk (ns).
        start: u64,
        /// Last log time of the chunk (ns).
        end: u64,
    },
    /// A file has fewer messages than it says are repeated.
    #[error("{expected} messages are repeated, of which {left:?} are missing")]
    RepeatedMissing {
        /// Number of messages that the file says are repeated.
        expected: u64,
        /// Those not found, by topic.
        left: BTreeMap<String, u64>,
    },
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
    /// Where an index points to is no such metadata record.
    #[error("expected the metadata record {expected:?}")]
    NoMetadata {
        /// The record's name.
        expected: String,
    },
    /// A metadata record has a text where a count belongs.
    #[error("metadata record: {key} is {value:?}, expected a count")]
    NotCount {
        /// The entry's key.
        key: String,
        /// Its value.
        value: String,
    },
    /// The first messages of a file are not those that it says are repeated.
    #[error(
        "message {index} of the file is of {topic}, expected one of the {expected} repeated messages: {left:?} are missing"
    )]
    NotRepeated {
        /// Index of the message.
        index: usize,
        /// Its topic.
        topic: String,
        /// Number of messages that the file says are repeated.
        expected: u64,
        /// Those not found, by topic.
        left: BTreeMap<String, u64>,
    },
    /// A channel has a schema that the file does not have.
    #[error("channel {channel} has schema {schema}, which is not in the file")]
    UnknownSchema {
        /// The channel.
        channel: u16,
        /// Its schema.
        schema: u16,
    },
    /// The file cannot be read from start to end.
    #[error("cannot be read from start to end: {source}")]
    Stream {
        /// What the reader says.
        source: Box<mcap::McapError>,
    },
    /// Two definitions of one id differ.
    #[error("{record} {id} is defined twice, and differently")]
    Redefined {
        /// Kind of the definition.
        record: &'static str,
        /// The id.
        id: u16,
    },
    /// A record tells something of others that is not so.
    #[error("{record} record: {field}: {told}, found {found}")]
    Disagrees {
        /// Kind of the record.
        record: &'static str,
        /// What it tells.
        field: &'static str,
        /// As the record has it.
        told: String,
        /// As it is.
        found: String,
    },
    /// A message has a channel that the file does not have.
    #[error("message {sequence} has channel {channel}, which is not in the file")]
    UnknownChannel {
        /// The message's sequence number.
        sequence: u32,
        /// Its channel.
        channel: u16,
    },
}

impl Damage {
    pub(crate) fn stream(source: mcap::McapError) -> Self {
        let source = Box::new(source);
        Self::Stream { source }
    }
}
