//! The recovered bag.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use mcap::records::MessageHeader;

use crate::{BagOptions, BagWriter, RecoverError, Topic, TopicId, WriteError};

/// Largest number of latched messages that are remembered.
const MOST: usize = 1 << 20;

/// What identifies a latched message wherever it stands: topic, publish time, sequence number, length and checksum.
pub(super) type Identity = (String, u64, u32, usize, u32);

/// The recovered bag, as far as it has come.
#[derive(Default)]
pub(super) struct NewBag {
    pub directory: PathBuf,
    /// `None` before the first message.
    pub writer: Option<BagWriter>,
    /// Topics without messages.
    pub silent: Vec<Topic>,
    /// The messages of latched topics that it holds.
    pub known: BTreeSet<Identity>,
    /// Number of messages that no checksum covers.
    pub unverified: u64,
    /// The last custom data that a file holds.
    pub custom: BTreeMap<String, String>,
}

impl NewBag {
    /// Begins a file; the first one begins the bag.
    pub fn begin(&mut self, name: &Path) -> Result<(), RecoverError> {
        let path = self.directory.join(name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(RecoverError::write(folder))?;
        }
        let name = name.display().to_string();
        if let Some(writer) = &mut self.writer {
            return Ok(writer.split_into(name)?);
        }
        let options = BagOptions::default();
        let writer = BagWriter::open(&self.directory, "recovered", name, options, false)?;
        self.writer = Some(writer);
        Ok(())
    }

    /// Returns true if the bag has the message already.
    pub fn has(&self, topic: &Topic, header: &MessageHeader, data: &[u8]) -> bool {
        self.known.contains(&identity(topic, header, data))
    }

    /// Writes a message into the file that was begun.
    pub fn write(
        &mut self,
        topic: &Topic,
        id: &mut Option<TopicId>,
        header: &MessageHeader,
        data: &[u8],
    ) -> Result<(), WriteError> {
        let Some(writer) = &mut self.writer else {
            return Ok(());
        };
        let id = match *id {
            Some(id) => id,
            None => *id.insert(writer.add_topic(topic)?),
        };
        let (log_time, publish_time) = (header.log_time, header.publish_time);
        writer.write(id, log_time, publish_time, header.sequence, data)?;
        if topic.qos.durable && self.known.len() < MOST {
            self.known.insert(identity(topic, header, data));
        }
        Ok(())
    }
}

fn identity(topic: &Topic, header: &MessageHeader, data: &[u8]) -> Identity {
    let (name, checksum) = (topic.name.clone(), crc32fast::hash(data));
    let (publish_time, sequence) = (header.publish_time, header.sequence);
    (name, publish_time, sequence, data.len(), checksum)
}
