//! Copies what is readable of a damaged file into the recovered bag.

use std::{borrow::Cow, collections::BTreeMap, path::Path};

use mcap::records::{ChunkHeader, MessageHeader, Metadata, Record, op};
use serde::Deserialize;

use super::{
    LeftOut, RecoveredFile,
    new_bag::NewBag,
    scan::{Piece, Scanner},
};
use crate::{
    CUSTOM_DATA, Compression, REPEATED, RecoverError, Topic, TopicId,
    metadata::RECORD,
    read::{Contents, MAX_RECORD_LENGTH, Source, footer, schema, summary, topic, unpacked},
    record::{self, parse, records},
    times::sum,
    yaml,
};

/// The part of rosbag2's description in a file that is of use.
#[derive(Deserialize)]
struct Described {
    #[serde(default)]
    custom_data: Option<BTreeMap<String, String>>,
}

struct Copy<'a> {
    source: &'a Source,
    /// Directory of the recovered bag, and path of the file within the bag.
    directory: &'a Path,
    name: &'a Path,
    bag: &'a mut NewBag,
    file: RecoveredFile,
    definitions: Contents,
    /// The topics by channel, with their ids once they have messages.
    topics: BTreeMap<u16, (Topic, Option<TopicId>)>,
    /// Compression of the first chunk.
    compression: Option<Compression>,
    /// Repeated messages still to come, by topic, and their log time.
    repeated: BTreeMap<String, u64>,
    head_time: Option<u64>,
}

/// Copies a file into a bag. Its number of missing messages is, as yet, the number that it says to hold.
pub(super) fn copy(
    source: &Source,
    directory: &Path,
    name: &Path,
    bag: &mut NewBag,
) -> Result<RecoveredFile, RecoverError> {
    // A summary has all definitions, and says how many messages there were.
    let summary = summary(source).ok().flatten();
    let magic = source.bytes(0, mcap::MAGIC.len() as u64)?;
    let mut copy = Copy {
        file: RecoveredFile {
            path: source.path.clone(),
            bytes: Some(source.size),
            complete: magic == mcap::MAGIC && footer(source).is_ok(),
            missing: summary.as_ref().map(|it| sum(it.counts.values().copied())),
            ..RecoveredFile::default()
        },
        source,
        directory,
        name,
        bag,
        definitions: summary.unwrap_or_default(),
        topics: BTreeMap::new(),
        compression: None,
        repeated: BTreeMap::new(),
        head_time: None,
    };
    if !mcap::MAGIC.starts_with(&magic) {
        let reason = format!("it starts with {magic:02x?}, expected the MCAP magic");
        copy.leave_out(0, magic.len() as u64, reason);
    }
    let mut scanner = Scanner::new(source);
    while let Some(piece) = scanner.next()? {
        match piece {
            Piece::Damage(place) => copy.file.leave_out(place),
            Piece::Record {
                opcode,
                offset,
                body,
            } => copy.record(opcode, &body, offset, false)?,
            Piece::Chunk {
                offset,
                header,
                records,
            } => copy.chunk(offset, &header, &records)?,
        }
    }
    let channels: Vec<_> = copy.definitions.channels.keys().copied().collect();
    for channel in channels {
        if let Err(reason) = copy.resolve(channel, 0) {
            copy.leave_out(0, 0, reason);
        }
    }
    let silent = copy.topics.into_values().filter(|(_, id)| id.is_none());
    copy.bag.silent.extend(silent.map(|(topic, _)| topic));
    Ok(copy.file)
}

impl Copy<'_> {
    fn chunk(
        &mut self,
        offset: u64,
        header: &ChunkHeader,
        bytes: &[u8],
    ) -> Result<(), RecoverError> {
        self.compression.get_or_insert(match &*header.compression {
            "lz4" => Compression::Lz4,
            "zstd" => Compression::Zstd,
            _ => Compression::None,
        });
        for record in records(bytes) {
            match record {
                Ok((opcode, place)) => {
                    let is_checked = header.uncompressed_crc != 0;
                    self.record(opcode, &bytes[place], offset, is_checked)?;
                }
                Err(damage) => self.leave_out(offset, 0, damage.to_string()),
            }
        }
        Ok(())
    }

    fn record(
        &mut self,
        opcode: u8,
        body: &[u8],
        offset: u64,
        is_checked: bool,
    ) -> Result<(), RecoverError> {
        let taken = match opcode {
            op::MESSAGE => {
                let kept = self.message(body, offset)?;
                self.bag.unverified += u64::from(kept.is_ok() && !is_checked);
                kept
            }
            op::SCHEMA | op::CHANNEL | op::METADATA => match parse(opcode, body) {
                Ok(record) => {
                    self.take(record, is_checked);
                    Ok(())
                }
                Err(damage) => Err(damage.to_string()),
            },
            _ => Ok(()),
        };
        if let Err(reason) = taken {
            self.leave_out(offset, body.len() as u64, reason);
        }
        Ok(())
    }

    /// Takes a definition or metadata.
    fn take(&mut self, record: Record<'_>, is_checked: bool) {
        match record {
            Record::Schema { header, data } => {
                let known = &mut self.definitions.schemas;
                define(known, header.id, schema(header, data), is_checked);
            }
            Record::Channel(channel) => {
                let known = &mut self.definitions.channels;
                define(known, channel.id, channel, is_checked);
            }
            Record::Metadata(record) if record.name == CUSTOM_DATA => {
                self.bag.custom = record.metadata;
            }
            Record::Metadata(record) if record.name == REPEATED && self.file.messages == 0 => {
                self.repeated = record::repeated(record).unwrap_or_default();
            }
            Record::Metadata(Metadata { name, metadata }) if name == RECORD.0 => {
                let described = metadata.get(RECORD.1).map(|text| yaml::read(text));
                if let Some(Ok(Described {
                    custom_data: Some(custom),
                })) = described
                {
                    self.bag.custom = custom;
                }
            }
            _ => {}
        }
    }

    /// Copies a message; the inner error says why it cannot be kept.
    fn message(&mut self, body: &[u8], offset: u64) -> Result<Result<(), String>, RecoverError> {
        let (header, data) = match self.read(body, offset) {
            Ok(message) => message,
            Err(reason) => return Ok(Err(reason)),
        };
        if self.is_repeated(&header, &data) {
            self.file.messages += 1;
            return Ok(Ok(()));
        }
        if !self.file.kept {
            let compression = self.compression.unwrap_or_default();
            self.bag.begin(self.directory, self.name, compression)?;
            self.file.kept = true;
        }
        let Some((topic, id)) = self.topics.get_mut(&header.channel_id) else {
            return Ok(Ok(()));
        };
        let written = self.bag.write(topic, id, &header, &data)?;
        self.file.messages += u64::from(written.is_ok());
        Ok(written)
    }

    fn read<'b>(
        &mut self,
        body: &'b [u8],
        offset: u64,
    ) -> Result<(MessageHeader, Cow<'b, [u8]>), String> {
        if body.len() > MAX_RECORD_LENGTH {
            return Err(format!("a message of more than {MAX_RECORD_LENGTH} bytes"));
        }
        let (header, data) = record::message(body).map_err(|damage| damage.to_string())?;
        let data = unpacked(data).map_err(|damage| damage.to_string())?;
        self.resolve(header.channel_id, offset)?;
        Ok((header, data))
    }

    /// Makes the topic of a channel known, or says why its messages cannot be kept.
    fn resolve(&mut self, id: u16, offset: u64) -> Result<(), String> {
        if self.topics.contains_key(&id) {
            return Ok(());
        }
        let Some(channel) = self.definitions.channels.get(&id) else {
            return Err(format!("the definition of channel {id} is lost"));
        };
        let found = topic(&self.source.path, channel, &self.definitions.schemas);
        let (topic, fault) = found.map_err(|topic| format!("{}: {}", topic.name, topic.reason))?;
        if let Some(fault) = fault {
            self.leave_out(offset, 0, fault.to_string());
        }
        self.topics.insert(id, (topic, None));
        Ok(())
    }

    /// Returns true if the message is repeated at the head of the file and the bag has it already: the file will repeat it
    /// again. One that the bag does not have is all that is left of a message that was lost.
    fn is_repeated(&mut self, header: &MessageHeader, data: &[u8]) -> bool {
        if *self.head_time.get_or_insert(header.log_time) != header.log_time {
            self.repeated.clear();
        }
        let (topic, _) = &self.topics[&header.channel_id];
        let Some(left @ 1..) = self.repeated.get_mut(&topic.name) else {
            return false;
        };
        *left -= 1;
        self.bag.has(topic, header, data)
    }

    fn leave_out(&mut self, offset: u64, bytes: u64, reason: String) {
        self.file.leave_out(LeftOut {
            offset,
            bytes,
            reason,
            times: None,
        });
    }
}

/// Adds a definition. One that a checksum covers replaces one without.
fn define<T>(known: &mut BTreeMap<u16, T>, id: u16, definition: T, is_checked: bool) {
    if is_checked {
        known.insert(id, definition);
    } else {
        known.entry(id).or_insert(definition);
    }
}
