//! One MCAP file of a bag.
//!
//! No length found in the file is believed beyond [`MAX_RECORD_LENGTH`] and [`MAX_CHUNK_LENGTH`].

mod chunk;
mod contents;
mod scan;
mod source;
mod summary;

use std::{collections::BTreeMap, path::Path};

use mcap::{
    MAGIC,
    records::{Channel, MessageHeader, Record, op},
};

pub use contents::Chunks;
pub(crate) use {
    chunk::{Batch, unpack},
    contents::{Contents, Schema, Span, schema},
    source::{Source, ZSTD_MAGIC, refuse_other},
    summary::{has_end, read as summary},
};

use crate::{
    BagError, Damage, LeftOutTopic, PROFILE, Qos, REPEATED, SERIALIZATION_FORMAT, Topic,
    channel_key,
    damage::agree,
    record::{PREFIX, parse},
};

/// Longest record that is read: far above any message of lgvi, and an image of 4K still fits.
pub(crate) const MAX_RECORD_LENGTH: usize = 64 << 20;

/// Longest chunk that is read: rosbag2's are of 768 KiB, or as long as a message.
pub(crate) const MAX_CHUNK_LENGTH: usize = 256 << 20;

/// Longest record of a chunk that is read: its header, and records that are not compressed.
pub(crate) const MAX_PACKED_LENGTH: usize = MAX_CHUNK_LENGTH + 1024;

const MAGIC_LENGTH: u64 = MAGIC.len() as u64;

/// An MCAP file, of which topics and places of messages are in memory.
pub(crate) struct McapFile {
    source: Source,
    /// Topics by channel, but for those left out.
    pub topics: BTreeMap<u16, Topic>,
    /// Topics whose messages cannot be given out.
    pub left_out: Vec<LeftOutTopic>,
    /// What is odd about topics that can be read.
    pub odd: Vec<BagError>,
    pub contents: Contents,
    /// What is wrong with the rest of the file, of one that is opened in spite of that.
    pub fault: Option<BagError>,
}

impl McapFile {
    /// Reads header and summary; the whole file, once, if it has none that tells of all messages.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let source = Source::open(path)?;
        check_header(&source)?;
        if let Some(contents) = summary::read(&source)? {
            return Self::new(source, contents, None);
        }
        match scan::scan(&source) {
            (_, Some(fault)) => Err(fault),
            (contents, None) => Self::new(source, contents, None),
        }
    }

    /// Reads a file that cannot be opened up to its first fault.
    pub fn open_damaged(path: &Path, unopened: BagError) -> Result<Self, BagError> {
        let source = Source::open(path)?;
        check_header(&source)?;
        let (contents, fault) = scan::scan(&source);
        Self::new(source, contents, Some(fault.unwrap_or(unopened)))
    }

    fn new(source: Source, contents: Contents, fault: Option<BagError>) -> Result<Self, BagError> {
        let mut topics = BTreeMap::new();
        let mut left_out = Vec::new();
        let mut odd = Vec::new();
        for channel in contents.channels.values() {
            match topic(&source, channel, &contents.schemas)? {
                Err(topic) => left_out.push(topic),
                Ok((topic, fault)) => {
                    topics.insert(channel.id, topic);
                    odd.extend(fault);
                }
            }
        }
        Ok(Self {
            topics,
            left_out,
            odd,
            source,
            contents,
            fault,
        })
    }

    pub fn path(&self) -> &Path {
        &self.source.path
    }

    /// Bytes of the file, of the unpacked one if it is compressed as a whole.
    pub fn size(&self) -> u64 {
        self.source.size
    }

    /// Reads the whole file: all damaged chunks, or else the first fault.
    pub fn check(&self) -> Vec<BagError> {
        scan::check(&self.source, &self.contents)
    }

    /// How many of the first messages of each span are repeated from an earlier file, by the span's offset.
    pub fn repeated_messages(&self) -> Result<BTreeMap<u64, usize>, BagError> {
        let mut by_span = BTreeMap::new();
        let mut left = self.contents.repeated.clone();
        left.retain(|_, count| *count > 0);
        let disagrees = |left: &BTreeMap<String, u64>, found: &str| Damage::Disagrees {
            record: REPEATED,
            field: "messages left",
            told: format!("{left:?}"),
            found: found.to_owned(),
        };
        let mut spans: Vec<_> = self.contents.spans.iter().collect();
        spans.sort_by_key(|span| span.offset);
        for span in spans {
            if left.is_empty() {
                return Ok(by_span);
            }
            let mut repeated = 0;
            self.read(span, 0, |header| {
                if !left.is_empty() {
                    let topic = &self.contents.channels[&header.channel_id].topic;
                    let Some(count) = left.get_mut(topic) else {
                        return Err(disagrees(&left, topic));
                    };
                    *count -= 1;
                    if *count == 0 {
                        left.remove(topic);
                    }
                    repeated += 1;
                }
                Ok(false)
            })?;
            by_span.insert(span.offset, repeated);
        }
        if left.is_empty() {
            return Ok(by_span);
        }
        let damage = disagrees(&left, "the end of the file");
        Err(self.source.damaged(0, damage))
    }

    /// The messages of a span, but for its first `repeated` ones, that are wanted.
    pub fn read(
        &self,
        span: &Span,
        repeated: usize,
        mut wanted: impl FnMut(&MessageHeader) -> Result<bool, Damage>,
    ) -> Result<Batch, BagError> {
        let damaged = |damage| self.source.damaged(span.offset, damage);
        let bytes = if span.is_chunk {
            self.unpack(span)?
        } else {
            self.source.bytes(span.offset, span.length)?
        };
        let known = |header: &MessageHeader| {
            let (record, id) = ("channel", header.channel_id);
            if !self.contents.channels.contains_key(&id) {
                return Err(Damage::Undefined { record, id });
            }
            span.check_time(header.log_time)?;
            wanted(header)
        };
        Batch::new(bytes, repeated, known).map_err(damaged)
    }

    fn unpack(&self, span: &Span) -> Result<Vec<u8>, BagError> {
        let damaged = |damage| self.source.damaged(span.offset, damage);
        let (opcode, body) = self.source.record(span.offset, MAX_PACKED_LENGTH)?;
        let length = (PREFIX + body.len()) as u64;
        agree("chunk index", "operation code", op::CHUNK, opcode).map_err(damaged)?;
        agree("chunk index", "length", span.length, length).map_err(damaged)?;
        match parse(opcode, &body).map_err(damaged)? {
            Record::Chunk { header, data } => unpack(&header, &data).map_err(damaged),
            other => Err(damaged(Damage::Disagrees {
                record: "chunk index",
                field: "record",
                told: "a chunk".to_owned(),
                found: format!("{other:?}"),
            })),
        }
    }

    /// A message of the span that is damaged in itself.
    pub fn damaged(&self, offset: u64, damage: Damage) -> BagError {
        self.source.damaged(offset, damage)
    }
}

fn check_header(source: &Source) -> Result<(), BagError> {
    let (opcode, body) = source.record(MAGIC_LENGTH, MAX_RECORD_LENGTH)?;
    let record = parse(opcode, &body).map_err(|damage| source.damaged(MAGIC_LENGTH, damage))?;
    match record {
        Record::Header(header) if !["", PROFILE].contains(&&*header.profile) => Err(
            BagError::unexpected(&source.path, "profile", header.profile, PROFILE),
        ),
        _ => Ok(()),
    }
}

/// A channel's topic, and what is wrong with its quality of service: it is then ROS 2's default. The inner error is of a
/// channel whose messages cannot be given out: MCAP allows any encoding, and messages without schema.
pub(crate) fn topic(
    source: &Source,
    channel: &Channel,
    schemas: &BTreeMap<u16, Schema>,
) -> Result<Result<(Topic, Option<BagError>), LeftOutTopic>, BagError> {
    let schema = schemas.get(&channel.schema_id);
    let encoding = &channel.message_encoding;
    let reason = if encoding != SERIALIZATION_FORMAT {
        Some(format!(
            "its messages are {encoding:?}, expected {SERIALIZATION_FORMAT:?}"
        ))
    } else if channel.schema_id == 0 {
        Some("it has no type and no definition".to_owned())
    } else {
        None
    };
    if let Some(reason) = reason {
        return Ok(Err(LeftOutTopic {
            name: channel.topic.clone(),
            type_name: schema.map_or_else(String::new, |schema| schema.name.clone()),
            reason,
        }));
    }
    let Some(schema) = schema else {
        let (record, id) = ("schema", channel.schema_id);
        return Err(source.damaged(0, Damage::Undefined { record, id }));
    };
    let metadata = |key| channel.metadata.get(key).map_or("", String::as_str);
    let qos = Qos::from_yaml(metadata(channel_key::QOS));
    let topic = Topic {
        name: channel.topic.clone(),
        type_name: schema.name.clone(),
        type_hash: metadata(channel_key::TYPE_HASH).to_owned(),
        definition: String::from_utf8_lossy(&schema.data).into_owned(),
        definition_encoding: schema.encoding.clone(),
        qos: qos.as_ref().copied().unwrap_or_default(),
    };
    let fault = qos.err().map(|error| BagError::Qos {
        file: source.path.clone(),
        topic: channel.topic.clone(),
        source: error,
    });
    Ok(Ok((topic, fault)))
}
