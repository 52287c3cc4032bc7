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
    records::{Channel, MessageHeader, Record},
};

pub use contents::Chunks;
pub(crate) use {
    chunk::{Batch, unpack, unpacked},
    contents::{Contents, Schema, Span, schema},
    source::Source,
    summary::{footer, read as summary, told},
};

use crate::{
    BagError, Damage, LeftOutTopic, PROFILE, Qos, REPEATED, SERIALIZATION_FORMAT, Topic,
    channel_key,
    error::agree,
    record::{PREFIX, parse},
};

/// Longest record that is read: far above any message of lgvi, and an image of 4K still fits.
pub(crate) const MAX_RECORD_LENGTH: usize = 64 << 20;

/// Longest chunk that is read: rosbag2's are of 768 KiB, or as long as a message.
pub(crate) const MAX_CHUNK_LENGTH: usize = 256 << 20;

/// Longest record of a chunk that is read: its header, and records that are not compressed.
pub(crate) const MAX_PACKED_LENGTH: usize = MAX_CHUNK_LENGTH + 1024;

const MAGIC_LENGTH: u64 = MAGIC.len() as u64;

/// An MCAP file, of which definitions and places of messages are in memory.
pub(crate) struct McapFile {
    pub source: Source,
    pub contents: Contents,
    /// What is wrong with the rest of the file.
    pub fault: Option<BagError>,
}

/// Messages at the head of a file that are repeated from an earlier one.
#[derive(Default)]
pub(crate) struct Repeated {
    /// How many of the first messages of each span are, by the span's offset.
    pub by_span: BTreeMap<u64, usize>,
    pub by_channel: BTreeMap<u16, u64>,
}

impl McapFile {
    /// Reads header and summary; the whole file, once and up to its first fault, if it has none that tells of all messages.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let source = Source::open(path)?;
        check_header(&source)?;
        let (contents, fault) = match summary(&source) {
            Ok(Some(contents)) => (contents, None),
            Ok(None) => scan::scan(&source),
            Err(fault) => {
                let (contents, found) = scan::scan(&source);
                (contents, Some(found.unwrap_or(fault)))
            }
        };
        Ok(Self {
            source,
            contents,
            fault,
        })
    }

    /// Reads the whole file, to the first fault.
    pub fn check(&self) -> Result<(), BagError> {
        scan::check(&self.source, &self.contents)
    }

    /// Finds the messages that the file says are repeated.
    pub fn repeated_messages(&self) -> Result<Repeated, BagError> {
        let disagree = |text| Damage(format!("{REPEATED} record: {text}"));
        let mut left = self.contents.repeated.clone();
        left.retain(|_, count| *count > 0);
        let mut spans: Vec<_> = self.contents.spans.iter().collect();
        spans.sort_by_key(|span| span.offset);
        let mut repeated = Repeated::default();
        for span in spans {
            if left.is_empty() {
                break;
            }
            let of_span = repeated.by_span.entry(span.offset).or_default();
            self.read(span, 0, |header| {
                if left.is_empty() {
                    return Ok(false);
                }
                let topic = &self.contents.channels[&header.channel_id].topic;
                let Some(count) = left.get_mut(topic) else {
                    return Err(disagree(format!("{left:?} are left, found {topic}")));
                };
                *count -= 1;
                if *count == 0 {
                    left.remove(topic);
                }
                *of_span += 1;
                *repeated.by_channel.entry(header.channel_id).or_default() += 1;
                Ok(false)
            })?;
        }
        if left.is_empty() {
            return Ok(repeated);
        }
        let damage = disagree(format!("{left:?} are left, found the end of the file"));
        Err(self.source.damaged(0, damage))
    }

    /// The messages of a span, but for its first `repeated` ones, that are wanted.
    pub fn read(
        &self,
        span: &Span,
        repeated: usize,
        mut wanted: impl FnMut(&MessageHeader) -> Result<bool, Damage>,
    ) -> Result<Batch, BagError> {
        let (start, end) = span.times;
        let bytes = match span.is_chunk {
            true => self.unpack(span)?,
            false => self.source.bytes(span.offset, span.length)?,
        };
        let known = |header: &MessageHeader| {
            if !self.contents.channels.contains_key(&header.channel_id) {
                return Err(Damage::undefined("channel", header.channel_id));
            }
            let found = (start.min(header.log_time), end.max(header.log_time));
            agree("chunk index record: log times", (start, end), found)?;
            wanted(header)
        };
        let damaged = |damage| self.source.damaged(span.offset, damage);
        Batch::new(bytes, repeated, known).map_err(damaged)
    }

    fn unpack(&self, span: &Span) -> Result<Vec<u8>, BagError> {
        let (opcode, body) = self.source.record(span.offset, MAX_PACKED_LENGTH)?;
        let length = (PREFIX + body.len()) as u64;
        let unpacked = agree("chunk index record: length", span.length, length)
            .and_then(|()| parse(opcode, &body))
            .and_then(|record| match record {
                Record::Chunk { header, data } => unpack(&header, &data),
                _ => Err(Damage(format!("record {opcode:#04x}, expected a chunk"))),
            });
        unpacked.map_err(|damage| self.source.damaged(span.offset, damage))
    }
}

fn check_header(source: &Source) -> Result<(), BagError> {
    let (opcode, body) = source.record(MAGIC_LENGTH, MAX_RECORD_LENGTH)?;
    let record = parse(opcode, &body).map_err(|damage| source.damaged(MAGIC_LENGTH, damage))?;
    match record {
        Record::Header(header) if !["", PROFILE].contains(&&*header.profile) => {
            let reason = format!("profile is {}, expected {PROFILE}", header.profile);
            Err(BagError::invalid(&source.path, reason))
        }
        _ => Ok(()),
    }
}

/// A channel's topic, and what is wrong with its quality of service: it is then ROS 2's default. Or the reason why its
/// messages cannot be given out: MCAP allows any encoding, and messages without schema.
pub(crate) fn topic(
    path: &Path,
    channel: &Channel,
    schemas: &BTreeMap<u16, Schema>,
) -> Result<(Topic, Option<BagError>), LeftOutTopic> {
    let name = &channel.topic;
    let encoding = &*channel.message_encoding;
    let found = schemas.get(&channel.schema_id);
    let (SERIALIZATION_FORMAT, Some(schema)) = (encoding, found) else {
        let reason = match channel.schema_id {
            _ if encoding != SERIALIZATION_FORMAT => {
                format!("its messages are {encoding:?}, expected {SERIALIZATION_FORMAT:?}")
            }
            0 => "it has no type and no definition".to_owned(),
            id => format!("schema {id} is not in the file"),
        };
        return Err(LeftOutTopic {
            name: name.clone(),
            type_name: found.map_or_else(String::new, |schema| schema.name.clone()),
            reason,
        });
    };
    let metadata = |key| channel.metadata.get(key).map_or("", String::as_str);
    let qos = Qos::from_yaml(metadata(channel_key::QOS));
    let topic = Topic {
        name: name.clone(),
        type_name: schema.name.clone(),
        type_hash: metadata(channel_key::TYPE_HASH).to_owned(),
        definition: String::from_utf8_lossy(&schema.data).into_owned(),
        definition_encoding: schema.encoding.clone(),
        qos: qos.as_ref().copied().unwrap_or_default(),
    };
    let fault = qos.err().map(|error| {
        let key = channel_key::QOS;
        let reason = format!("{key} of {name}: {error}; the default is used");
        BagError::invalid(path, reason)
    });
    Ok((topic, fault))
}
