//! How a bag is to be written, and what it is in the end.

use std::{collections::BTreeMap, num::NonZeroU64, path::PathBuf, time::Duration};

/// How a bag is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BagOptions {
    /// Compression of the MCAP chunks.
    pub compression: Compression,
    /// Size (bytes) from which on a file is closed and the next one begun; none: any. It is looked at when a message
    /// comes, and counts what is written, schemas of the topics included: a file gets larger by at most a chunk (an eighth, or
    /// 1 KiB, or the longest message) and its end, which has index and schemas again. It has one message of its own at least,
    /// however long its schemas are.
    pub max_bytes: Option<NonZeroU64>,
    /// The next file begins with the first message whose log time is more than this after that of the file's first
    /// message; none: never. Messages from before the file's first one go into the file that is open.
    pub max_duration: Option<Duration>,
}

/// Compression of MCAP chunks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// None: the fastest.
    None,
    /// zstd at its fastest level. The default: it still writes a million messages of 364 B a second (`lgvi_bench bag`), a
    /// seventh of what goes without compression.
    #[default]
    Zstd,
    /// lz4: faster than zstd, and larger.
    Lz4,
}

/// What a finished bag holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagSummary {
    /// Number of messages of each topic, each counted once.
    pub messages: BTreeMap<String, u64>,
    /// Number of messages that later files repeat.
    pub repeated: u64,
    /// The MCAP files.
    pub files: Vec<PathBuf>,
    /// Size of the MCAP files.
    pub bytes: u64,
    /// First and last log time (ns); none in a bag without messages.
    pub times: Option<(u64, u64)>,
}
