//! The recovered bag.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use mcap::records::MessageHeader;

use crate::{BagOptions, BagWriter, Compression, Durability, RecoverError, Topic, TopicId};

/// Largest number of latched messages that are remembered.
const MOST: usize = 1 << 20;

/// What identifies a latched message wherever it stands: topic, publish time, sequence number, length and checksum.
type Identity = (String, u64, u32, usize, u32);

/// The recovered bag, as far as it has come.
#[derive(Default)]
pub(super) struct NewBag {
    /// `None` before the first message.
    writer: Option<BagWriter>,
    /// Topics without messages.
    pub silent: Vec<Topic>,
    /// The messages of latched topics that it holds.
    known: BTreeSet<Identity>,
    /// Number of messages that no checksum covers.
    pub unverified: u64,
    /// The last custom data that a file holds.
    pub custom: BTreeMap<String, String>,
}

impl NewBag {
    /// Begins a file; the first one begins the bag.
    pub fn begin(
        &mut self,
        directory: &Path,
        name: &Path,
        compression: Compression,
    ) -> Result<(), RecoverError> {
        let path = directory.join(name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(RecoverError::write(folder))?;
        }
        let name = name.display().to_string();
        if let Some(writer) = &mut self.writer {
            writer.options.compression = compression;
            return Ok(writer.split_into(name)?);
        }
        let options = BagOptions {
            compression,
            ..BagOptions::default()
        };
        let writer = BagWriter::open(directory, "recovered", name, options, false)?;
        self.writer = Some(writer);
        Ok(())
    }

    /// Returns true if the bag has the message already.
    pub fn has(&self, topic: &Topic, header: &MessageHeader, data: &[u8]) -> bool {
        self.known.contains(&identity(topic, header, data))
    }

    /// Writes a message; the inner error says why it cannot be taken.
    pub fn write(
        &mut self,
        topic: &Topic,
        id: &mut Option<TopicId>,
        header: &MessageHeader,
        data: &[u8],
    ) -> Result<Result<(), String>, RecoverError> {
        let Some(writer) = &mut self.writer else {
            return Ok(Err("no file is begun".to_owned()));
        };
        let mut write = || {
            let id = match *id {
                Some(id) => id,
                None => *id.insert(writer.add_topic(topic)?),
            };
            let (log_time, publish_time) = (header.log_time, header.publish_time);
            writer.write(id, log_time, publish_time, header.sequence, data)
        };
        match write() {
            Ok(()) => {}
            Err(error) if writer.is_ended() => return Err(error.into()),
            Err(error) => return Ok(Err(error.to_string())),
        }
        if topic.qos.durability == Durability::TransientLocal && self.known.len() < MOST {
            self.known.insert(identity(topic, header, data));
        }
        Ok(Ok(()))
    }

    /// The writer, for the end of the bag; with the topics without messages.
    pub fn finish(self) -> Result<Option<BagWriter>, RecoverError> {
        let Some(mut writer) = self.writer else {
            return Ok(None);
        };
        for topic in &self.silent {
            match writer.add_topic(topic) {
                Err(error) if writer.is_ended() => return Err(error.into()),
                // The bag has it under another type.
                _ => {}
            }
        }
        Ok(Some(writer))
    }
}

fn identity(topic: &Topic, header: &MessageHeader, data: &[u8]) -> Identity {
    let checksum = crc32fast::hash(data);
    let (publish_time, sequence) = (header.publish_time, header.sequence);
    (
        topic.name.clone(),
        publish_time,
        sequence,
        data.len(),
        checksum,
    )
}
