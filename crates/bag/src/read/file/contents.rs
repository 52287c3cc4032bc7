use std::collections::BTreeMap;

use crate::{
    Damage,
    records::{Channel, ChunkIndex, Schema},
};

/// What is in a file, and where.
#[derive(Default)]
pub(crate) struct Contents {
    pub schemas: BTreeMap<u16, Schema>,
    pub channels: BTreeMap<u16, Channel>,
    pub spans: Vec<Span>,
    /// Number of messages of each channel that has any, if known.
    pub counts: Option<BTreeMap<u16, u64>>,
    /// First and last log time (ns).
    pub times: Option<(u64, u64)>,
    /// How many of the first messages of each topic are repeated from an earlier file of the bag.
    pub repeated: BTreeMap<String, u64>,
    /// Chunks by their compression.
    pub chunks: BTreeMap<String, Chunks>,
}

/// Chunks of one compression.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Chunks {
    /// Number of chunks.
    pub count: u64,
    /// Bytes in the file.
    pub packed: u64,
    /// Bytes of the records.
    pub unpacked: u64,
}

/// A part of the file that is read at once.
#[derive(Clone)]
pub(crate) struct Span {
    /// No message in it is earlier (ns).
    pub start_time: u64,
    /// No message in it is later (ns).
    pub end_time: u64,
    pub offset: u64,
    pub length: u64,
    /// Whether it is a chunk; else messages lie in the file one after the other.
    pub is_chunk: bool,
    /// Channels of its messages, if known.
    pub channels: Option<Box<[u16]>>,
}

impl Contents {
    pub fn add_chunk(&mut self, compression: &str, packed: u64, unpacked: u64) {
        let chunks = self.chunks.entry(compression.to_owned()).or_default();
        chunks.count += 1;
        chunks.packed = chunks.packed.saturating_add(packed);
        chunks.unpacked = chunks.unpacked.saturating_add(unpacked);
    }

    /// Widens the times to these.
    pub fn extend_times(&mut self, start: u64, end: u64) {
        let (first, last) = self.times.unwrap_or((start, end));
        self.times = Some((first.min(start), last.max(end)));
    }

    /// Adds a channel; those of one id are one and the same.
    pub fn add_channel(&mut self, channel: Channel) -> Result<(), Damage> {
        let known = self
            .channels
            .entry(channel.id)
            .or_insert_with(|| channel.clone());
        if (&known.topic, known.schema) == (&channel.topic, channel.schema) {
            return Ok(());
        }
        Err(Damage::OtherChannel {
            channel: channel.id,
            topics: [known.topic.clone(), channel.topic],
        })
    }
}

impl Span {
    /// The chunk of a chunk index.
    pub fn of_index(index: &ChunkIndex) -> Self {
        let channels = Some(index.channels.as_slice()).filter(|channels| !channels.is_empty());
        Self {
            start_time: index.start_time,
            end_time: index.end_time,
            offset: index.offset,
            length: index.length,
            is_chunk: true,
            channels: channels.map(Into::into),
        }
    }

    /// Whether messages of the time are in their place here.
    pub fn check_time(&self, sequence: u32, log_time: u64) -> Result<(), Damage> {
        if (self.start_time..=self.end_time).contains(&log_time) {
            return Ok(());
        }
        Err(Damage::OutOfTime {
            sequence,
            log_time,
            start: self.start_time,
            end: self.end_time,
        })
    }
}
