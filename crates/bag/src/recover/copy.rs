//! Copies what is readable of a damaged file into the recovered bag.

use std::{collections::BTreeMap, fs, path::Path};

use mcap::records::{ChunkHeader, MessageHeader, Metadata, Record, op};
use serde::Deserialize;

use super::{
    LeftOut, RecoverError, RecoveredFile,
    head::Head,
    new_bag::NewBag,
    scan::{Piece, Scanner},
};
use crate::{
    CUSTOM_DATA, Compression, Durability, REPEATED, Topic, TopicId,
    metadata::RECORD,
    read::{Contents, MAX_RECORD_LENGTH, Source, has_end, schema, summary, topic, unpacked},
    record::{self, Records, parse},
    times::sum,
    write::Kept,
    yaml,
};

/// The part of rosbag2's description in a file that is of use.
#[derive(Deserialize)]
struct Described {
    #[serde(default)]
    custom_data: Option<BTreeMap<String, String>>,
}

struct Copy<'a, 'b> {
    source: &'a Source,
    /// Path of the file within the bag.
    name: &'a Path,
    bag: &'a mut NewBag<'b>,
    file: RecoveredFile,
    definitions: Contents,
    /// The topics by channel, with their ids once they have messages.
    topics: BTreeMap<u16, (Topic, Option<TopicId>)>,
    /// Compression of the first chunk.
    compression: Option<Compression>,
    head: Option<Head>,
    /// What the file repeats of the messages that the bag has.
    repeated: Vec<(MessageHeader, Vec<u8>)>,
}

/// Copies a file into a bag. Its number of missing messages is, as yet, the number that it says to hold.
pub(super) fn copy(
    source: &Source,
    name: &Path,
    bag: &mut NewBag<'_>,
) -> Result<RecoveredFile, RecoverError> {
    // A summary has all definitions, and says how many messages there were.
    let definitions = summary(source).ok().flatten().unwrap_or_default();
    let counts = definitions.counts.as_ref();
    let magic = source.bytes(0, mcap::MAGIC.len() as u64)?;
    let mut copy = Copy {
        file: RecoveredFile {
            path: source.path.clone(),
            bytes: Some(source.size),
            complete: magic == mcap::MAGIC && has_end(source)?,
            missing: counts.map(|counts| sum(counts.values().copied())),
            ..RecoveredFile::default()
        },
        source,
        name,
        bag,
        definitions,
        topics: BTreeMap::new(),
        compression: None,
        head: None,
        repeated: Vec::new(),
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
    copy.finish()
}

impl Copy<'_, '_> {
    fn chunk(
        &mut self,
        offset: u64,
        header: &ChunkHeader,
        records: &[u8],
    ) -> Result<(), RecoverError> {
        self.compression.get_or_insert(match &*header.compression {
            "lz4" => Compression::Lz4,
            "zstd" => Compression::Zstd,
            _ => Compression::None,
        });
        for record in Records::new(records) {
            let Ok((opcode, place)) = record else {
                let reason = "the chunk ends within a record".to_owned();
                self.leave_out(offset, 0, reason);
                break;
            };
            let is_checked = header.uncompressed_crc != 0;
            self.record(opcode, &records[place], offset, is_checked)?;
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
        let parsed = match opcode {
            op::MESSAGE => {
                let kept = self.message(body, offset)?;
                self.bag.unverified += u64::from(kept && !is_checked);
                return Ok(());
            }
            op::SCHEMA | op::CHANNEL | op::METADATA => parse(opcode, body),
            _ => return Ok(()),
        };
        match parsed {
            Ok(Record::Schema { header, data }) => {
                let known = &mut self.definitions.schemas;
                define(known, header.id, schema(header, data), is_checked);
            }
            Ok(Record::Channel(channel)) => {
                let known = &mut self.definitions.channels;
                define(known, channel.id, channel, is_checked);
            }
            Ok(Record::Metadata(metadata)) => self.metadata(metadata),
            Ok(_) => {}
            Err(damage) => self.leave_out(offset, body.len() as u64, damage.to_string()),
        }
        Ok(())
    }

    fn metadata(&mut self, Metadata { name, metadata }: Metadata) {
        let (record, key) = RECORD;
        if name == CUSTOM_DATA {
            self.bag.custom = metadata;
        } else if name == record {
            let described = metadata.get(key).and_then(|text| yaml::read(text).ok());
            if let Some(Described {
                custom_data: Some(custom),
            }) = described
            {
                self.bag.custom = custom;
            }
        } else if name == REPEATED && self.file.messages == 0 {
            let counts = metadata.into_iter();
            let counts = counts.filter_map(|(topic, count)| Some((topic, count.parse().ok()?)));
            self.head = Some(Head::new(counts.collect()));
        }
    }

    /// Copies a message. Returns true if it could be kept.
    fn message(&mut self, body: &[u8], offset: u64) -> Result<bool, RecoverError> {
        let read = || {
            let (header, data) = record::message(body).map_err(|damage| damage.to_string())?;
            if body.len() > MAX_RECORD_LENGTH {
                return Err(format!("a message of more than {MAX_RECORD_LENGTH} bytes"));
            }
            let data = unpacked(data).map_err(|damage| damage.to_string())?;
            Ok((header, data))
        };
        let kept = match read() {
            Err(reason) => Err(reason),
            Ok((header, data)) => match self.resolve(header.channel_id, offset) {
                Err(reason) => Err(reason),
                Ok(()) if self.is_held(&header, &data) => Ok(()),
                Ok(()) => {
                    self.end_head()?;
                    self.write(&header, &data)?
                }
            },
        };
        match kept {
            Ok(()) => Ok(true),
            Err(reason) => {
                self.leave_out(offset, body.len() as u64, reason);
                Ok(false)
            }
        }
    }

    /// Makes the topic of a channel known, or says why its messages cannot be kept.
    fn resolve(&mut self, id: u16, offset: u64) -> Result<(), String> {
        if self.topics.contains_key(&id) {
            return Ok(());
        }
        let Some(channel) = self.definitions.channels.get(&id) else {
            return Err(format!("the definition of channel {id} is lost"));
        };
        let found = topic(self.source, channel, &self.definitions.schemas);
        let (mut topic, fault) = found
            .map_err(|error| error.to_string())?
            .map_err(|topic| format!("{}: {}", topic.name, topic.reason))?;
        if topic.type_hash.is_empty() {
            let hash = self.bag.hashes.get(&(&*topic.name, &*topic.type_name));
            topic.type_hash = hash.copied().unwrap_or_default().to_owned();
        }
        if let Some(fault) = fault {
            self.leave_out(offset, 0, fault.to_string());
        }
        self.topics.insert(id, (topic, None));
        Ok(())
    }

    fn is_held(&mut self, header: &MessageHeader, data: &[u8]) -> bool {
        let (topic, _) = &self.topics[&header.channel_id];
        let head = self.head.as_mut();
        head.is_some_and(|head| head.hold(&topic.name, header, data))
    }

    /// Has the file repeat what the bag has, and writes what was lost.
    fn end_head(&mut self) -> Result<(), RecoverError> {
        let Some(head) = self.head.take() else {
            return Ok(());
        };
        let (known, lost): (Vec<_>, Vec<_>) =
            head.messages.into_iter().partition(|(header, data)| {
                let (topic, _) = &self.topics[&header.channel_id];
                self.bag.known.contains(&topic.name, header, data)
            });
        self.file.messages += known.len() as u64;
        self.repeated = known;
        for (header, data) in lost {
            if let Err(reason) = self.write(&header, &data)? {
                self.leave_out(0, data.len() as u64, reason);
            }
        }
        Ok(())
    }

    /// Begins the file in the recovered bag.
    fn begin(&mut self) -> Result<(), RecoverError> {
        let path = self.bag.directory.join(self.name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(RecoverError::write(folder))?;
        }
        let compression = self.compression.unwrap_or_default();
        let writer = self.bag.open(self.name, compression)?;
        let mut messages = Vec::new();
        for (header, data) in std::mem::take(&mut self.repeated) {
            let (topic, _) = &self.topics[&header.channel_id];
            let kept = Kept {
                publish_time: header.publish_time,
                sequence: header.sequence,
                data,
            };
            match writer.add_topic(topic) {
                Ok(id) => messages.push((id, kept)),
                Err(error) if writer.is_ended() => return Err(error.into()),
                // The bag has it under another type.
                Err(_) => {}
            }
        }
        writer.go_on_in(self.name.display().to_string(), compression, messages)?;
        self.file.kept = true;
        Ok(())
    }

    /// Writes a message; the inner error says why it could not be taken.
    fn write(
        &mut self,
        header: &MessageHeader,
        data: &[u8],
    ) -> Result<Result<(), String>, RecoverError> {
        if !self.file.kept {
            self.begin()?;
        }
        let bag = &mut *self.bag;
        let writer = bag.open(self.name, Compression::default())?;
        let Some((topic, id)) = self.topics.get_mut(&header.channel_id) else {
            return Ok(Ok(()));
        };
        let mut write = || {
            let id = match *id {
                Some(id) => id,
                None => *id.insert(writer.add_topic(topic)?),
            };
            let MessageHeader {
                sequence,
                log_time,
                publish_time,
                ..
            } = *header;
            writer.write(id, log_time, publish_time, sequence, data)
        };
        match write() {
            Ok(()) => {}
            Err(error) if writer.is_ended() => return Err(error.into()),
            Err(error) => return Ok(Err(error.to_string())),
        }
        if topic.qos.durability == Durability::TransientLocal {
            bag.known.add(&topic.name, header, data);
        }
        self.file.messages += 1;
        Ok(Ok(()))
    }

    fn leave_out(&mut self, offset: u64, bytes: u64, reason: String) {
        self.file.leave_out(LeftOut {
            offset,
            bytes,
            reason,
            times: None,
        });
    }

    fn finish(mut self) -> Result<RecoveredFile, RecoverError> {
        self.end_head()?;
        let channels: Vec<_> = self.definitions.channels.keys().copied().collect();
        for channel in channels {
            if let Err(reason) = self.resolve(channel, 0) {
                self.leave_out(0, 0, reason);
            }
        }
        let topics = self.topics.into_values();
        let silent = topics.filter(|(_, id)| id.is_none());
        self.bag.silent.extend(silent.map(|(topic, _)| topic));
        self.bag.add_silent()?;
        Ok(self.file)
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
