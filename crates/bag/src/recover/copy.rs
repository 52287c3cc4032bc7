//! Copies what is readable of a damaged file into the recovered bag.

use std::{collections::BTreeMap, path::Path};

use mcap::records::{ChunkHeader, MessageHeader, Metadata, Record, op};
use serde::Deserialize;

use super::{
    LeftOut, RecoveredFile,
    new_bag::NewBag,
    scan::{Piece, Scanner},
};
use crate::{
    CUSTOM_DATA, Damage, REPEATED, RecoverError, Topic, TopicId, WriteError,
    metadata::RECORD,
    read::{Contents, MAX_RECORD_LENGTH, Source, footer, schema, told, topic, unpacked},
    record::{self, parse, records},
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
    /// Path of the file within the bag.
    name: &'a Path,
    bag: &'a mut NewBag,
    file: RecoveredFile,
    definitions: Contents,
    /// Bytes of definitions that the records of the file added.
    defined: usize,
    /// The topics by channel, with their ids once they have messages.
    topics: BTreeMap<u16, (Topic, Option<TopicId>)>,
    /// Repeated messages still to come, by topic, and their log time.
    repeated: BTreeMap<String, u64>,
    head_time: Option<u64>,
    /// Repeated messages at the head of the file, until all are read, and their bytes.
    head: Vec<(MessageHeader, Vec<u8>)>,
    head_bytes: usize,
}

/// Why a record is not copied.
enum Stop {
    /// It is left out.
    LeftOut(String),
    /// The bag cannot be written on.
    Failed(RecoverError),
}

impl From<Damage> for Stop {
    fn from(Damage(reason): Damage) -> Self {
        Self::LeftOut(reason)
    }
}

impl From<WriteError> for Stop {
    fn from(error: WriteError) -> Self {
        match error {
            WriteError::Refused(reason) => Self::LeftOut(reason),
            error => Self::Failed(error.into()),
        }
    }
}

/// Copies a file into a bag. Its number of missing messages is, as yet, the number that it says to hold.
pub(super) fn copy(
    source: &Source,
    name: &Path,
    bag: &mut NewBag,
) -> Result<RecoveredFile, RecoverError> {
    bag.next_file();
    // A summary has definitions, and says how many messages there were.
    let (definitions, count) = told(source).ok().flatten().unwrap_or_default();
    let magic = source.bytes(0, mcap::MAGIC.len() as u64)?;
    let mut copy = Copy {
        file: RecoveredFile {
            path: source.path.clone(),
            bytes: Some(source.size),
            complete: magic == mcap::MAGIC && footer(source).is_ok(),
            missing: count,
            ..RecoveredFile::default()
        },
        source,
        name,
        bag,
        definitions,
        defined: 0,
        topics: BTreeMap::new(),
        repeated: BTreeMap::new(),
        head_time: None,
        head: Vec::new(),
        head_bytes: 0,
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
    copy.hear(0, 0, |copy| copy.end_head())?;
    let channels: Vec<_> = copy.definitions.channels.keys().copied().collect();
    for channel in channels {
        if let Err(Damage(reason)) = copy.resolve(channel, 0) {
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
        for record in records(bytes) {
            match record {
                Ok((opcode, place)) => {
                    let is_checked = header.uncompressed_crc != 0;
                    self.record(opcode, &bytes[place], offset, is_checked)?;
                }
                Err(Damage(reason)) => self.leave_out(offset, 0, reason),
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
        self.hear(offset, body.len() as u64, |copy| {
            copy.take(opcode, body, offset, is_checked)
        })
    }

    /// Says what is left out.
    fn hear(
        &mut self,
        offset: u64,
        bytes: u64,
        work: impl FnOnce(&mut Self) -> Result<(), Stop>,
    ) -> Result<(), RecoverError> {
        match work(self) {
            Ok(()) => Ok(()),
            Err(Stop::LeftOut(reason)) => {
                self.leave_out(offset, bytes, reason);
                Ok(())
            }
            Err(Stop::Failed(error)) => Err(error),
        }
    }

    fn take(&mut self, opcode: u8, body: &[u8], offset: u64, is_checked: bool) -> Result<(), Stop> {
        if opcode == op::MESSAGE {
            self.message(body, offset)?;
            self.bag.unverified += u64::from(!is_checked);
            return Ok(());
        }
        if ![op::SCHEMA, op::CHANNEL, op::METADATA].contains(&opcode) {
            return Ok(());
        }
        if opcode != op::METADATA && self.defined > MAX_RECORD_LENGTH {
            let reason = format!("definitions of more than {MAX_RECORD_LENGTH} bytes before it");
            return Err(Stop::LeftOut(reason));
        }
        match parse(opcode, body)? {
            Record::Schema { header, data } => {
                let (id, known) = (header.id, &mut self.definitions.schemas);
                self.defined += define(known, id, schema(header, data), is_checked, body.len());
            }
            Record::Channel(channel) => {
                let (id, known) = (channel.id, &mut self.definitions.channels);
                self.defined += define(known, id, channel, is_checked, body.len());
            }
            Record::Metadata(record) if record.name == CUSTOM_DATA => {
                self.bag.custom = record.metadata;
            }
            Record::Metadata(record) if record.name == REPEATED && self.file.messages == 0 => {
                self.repeated = record::repeated(record)?;
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
        Ok(())
    }

    fn message(&mut self, body: &[u8], offset: u64) -> Result<(), Stop> {
        if body.len() > MAX_RECORD_LENGTH {
            let reason = format!("a message of more than {MAX_RECORD_LENGTH} bytes");
            return Err(Stop::LeftOut(reason));
        }
        let (header, data) = record::message(body)?;
        let data = unpacked(data)?;
        self.resolve(header.channel_id, offset)?;
        if self.is_repeated(&header) {
            self.head_bytes += data.len();
            self.head.push((header, data.into_owned()));
            if self.head_bytes > MAX_RECORD_LENGTH {
                self.end_head()?;
            }
        } else {
            self.end_head()?;
            self.keep(&header, &data)?;
        }
        self.file.messages += 1;
        Ok(())
    }

    /// Goes on behind the repeated messages. Of those that the bag has, the new file repeats what it may; one that the bag
    /// does not have is all that is left of a message that was lost.
    fn end_head(&mut self) -> Result<(), Stop> {
        self.head_bytes = 0;
        let mut lost = Vec::new();
        for (header, data) in std::mem::take(&mut self.head) {
            let (topic, _) = &self.topics[&header.channel_id];
            if !self.bag.repeat(topic, &header, &data)? {
                lost.push((header, data));
            }
        }
        for (header, data) in lost {
            self.keep(&header, &data)?;
        }
        Ok(())
    }

    fn keep(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), Stop> {
        if !self.file.kept {
            self.bag.begin(self.name).map_err(Stop::Failed)?;
            self.file.kept = true;
        }
        if let Some((topic, id)) = self.topics.get_mut(&header.channel_id) {
            self.bag.write(topic, id, header, data)?;
        }
        Ok(())
    }

    /// Makes the topic of a channel known, or says why its messages cannot be kept.
    fn resolve(&mut self, id: u16, offset: u64) -> Result<(), Damage> {
        if self.topics.contains_key(&id) {
            return Ok(());
        }
        let Some(channel) = self.definitions.channels.get(&id) else {
            return Err(Damage(format!("the definition of channel {id} is lost")));
        };
        let found = topic(&self.source.path, channel, &self.definitions.schemas);
        let (mut topic, fault) =
            found.map_err(|topic| Damage(format!("{}: {}", topic.name, topic.reason)))?;
        if let Some(fault) = fault {
            self.leave_out(offset, 0, fault.to_string());
        }
        if topic.type_hash.is_empty() {
            let known = (topic.name.clone(), topic.type_name.clone());
            topic.type_hash = self.bag.hashes.get(&known).cloned().unwrap_or_default();
        }
        self.topics.insert(id, (topic, None));
        Ok(())
    }

    /// Returns true if the file says that it repeats the message from an earlier file.
    fn is_repeated(&mut self, header: &MessageHeader) -> bool {
        if *self.head_time.get_or_insert(header.log_time) != header.log_time {
            self.repeated.clear();
        }
        let (topic, _) = &self.topics[&header.channel_id];
        let Some(left @ 1..) = self.repeated.get_mut(&topic.name) else {
            return false;
        };
        *left -= 1;
        true
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

/// Adds a definition of so many bytes; returns how many were added. One that a checksum covers replaces one without.
fn define<T: PartialEq>(
    known: &mut BTreeMap<u16, T>,
    id: u16,
    definition: T,
    is_checked: bool,
    length: usize,
) -> usize {
    let is_new = match known.get(&id) {
        Some(known) => is_checked && *known != definition,
        None => true,
    };
    if is_new {
        known.insert(id, definition);
    }
    usize::from(is_new) * length
}
