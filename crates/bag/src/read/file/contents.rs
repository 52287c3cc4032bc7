use std::{
    borrow::Cow,
    collections::{BTreeMap, BTreeSet, btree_map::Entry},
};

use mcap::records::{Channel, ChunkIndex, Record, SchemaHeader};

use super::MAX_RECORD_LENGTH;
use crate::{
    Damage,
    error::{agree, limited},
    times::Times,
};

/// A schema that is in memory.
pub(crate) type Schema = mcap::Schema<'static>;

/// The schema of a record.
pub(crate) fn schema(header: SchemaHeader, data: Cow<'_, [u8]>) -> Schema {
    Schema {
        id: header.id,
        name: header.name,
        encoding: header.encoding,
        data: data.into_owned().into(),
    }
}

/// What is in a file, and where.
#[derive(Default)]
pub(crate) struct Contents {
    pub schemas: BTreeMap<u16, Schema>,
    pub channels: BTreeMap<u16, Channel>,
    /// Bytes of all of them.
    definitions: u64,
    pub spans: Vec<Span>,
    /// Number of messages of each channel that has any.
    pub counts: BTreeMap<u16, u64>,
    pub times: Times,
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
pub(crate) struct Span {
    /// No message in it is earlier or later (ns).
    pub times: (u64, u64),
    pub offset: u64,
    pub length: u64,
    /// True if it is a chunk; else messages lie in the file one after the other.
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

    /// Holds what is told against what is found.
    pub fn agree_with(&self, found: &Self) -> Result<(), Damage> {
        let offsets: BTreeSet<_> = found.spans.iter().map(|span| span.offset).collect();
        let places = |contents: &Self| {
            // A chunk of definitions only may be told of.
            let spans = contents.spans.iter();
            let spans = spans.filter(|it| it.channels.is_some() || offsets.contains(&it.offset));
            let places = spans.map(|span| (span.offset, span.length, span.times));
            places.collect::<BTreeSet<_>>()
        };
        agree("chunk index record: chunks", places(self), places(found))?;
        let (told, found_counts) = (&self.counts, &found.counts);
        agree("statistics record: messages by channel", told, found_counts)?;
        agree("statistics record: log times", self.times, found.times)
    }

    /// Adds a schema or a channel of so many bytes; those of one id are one and the same.
    pub fn define(&mut self, record: Record<'_>, length: usize) -> Result<(), Damage> {
        let opcode = record.opcode();
        let is_new = match record {
            Record::Schema { header, data } => {
                let schema = schema(header, data);
                insert(&mut self.schemas, "schema", schema.id, schema)?
            }
            Record::Channel(channel) => insert(&mut self.channels, "channel", channel.id, channel)?,
            _ => false,
        };
        if is_new {
            self.definitions += length as u64;
        }
        limited(opcode, self.definitions, MAX_RECORD_LENGTH).map(drop)
    }
}

/// Adds a definition; false if it is known.
fn insert<T: PartialEq>(
    known: &mut BTreeMap<u16, T>,
    record: &str,
    id: u16,
    definition: T,
) -> Result<bool, Damage> {
    match known.entry(id) {
        Entry::Occupied(known) if *known.get() != definition => Err(Damage(format!(
            "{record} {id} has two different definitions"
        ))),
        Entry::Occupied(_) => Ok(false),
        Entry::Vacant(new) => {
            new.insert(definition);
            Ok(true)
        }
    }
}

impl Span {
    /// The chunk of a chunk index.
    pub fn of_index(index: &ChunkIndex) -> Self {
        let channels: Box<[u16]> = index.message_index_offsets.keys().copied().collect();
        Self {
            times: (index.message_start_time, index.message_end_time),
            offset: index.chunk_start_offset,
            length: index.chunk_length,
            is_chunk: true,
            channels: Some(channels).filter(|channels| !channels.is_empty()),
        }
    }
}
