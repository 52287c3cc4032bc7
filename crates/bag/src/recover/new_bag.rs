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

/// What identifies a latched message of a topic wherever it stands: publish time, sequence number, length and checksum.
pub(super) type Identity = (u64, u32, usize, u32);

/// The recovered bag, as far as it has come.
#[derive(Default)]
pub(super) struct NewBag {
    pub directory: PathBuf,
    /// `None` before the first message.
    pub writer: Option<BagWriter>,
    /// Topics without messages.
    pub silent: Vec<Topic>,
    /// The messages of latched topics that it holds.
    pub known: BTreeMap<String, BTreeSet<Identity>>,
    /// Number of all of them.
    pub remembered: usize,
    /// Those that the file that is read repeats at its head: the new file repeats them, too.
    pub repeated: Vec<(TopicId, MessageHeader, Vec<u8>)>,
    /// Hash of each topic's type by name and type, by `metadata.yaml`.
    pub hashes: BTreeMap<(String, String), String>,
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
            let repeated = std::mem::take(&mut self.repeated);
            return Ok(writer.split_into(name, repeated)?);
        }
        let options = BagOptions::default();
        let writer = BagWriter::open(&self.directory, "recovered", name, options, false)?;
        self.writer = Some(writer);
        Ok(())
    }

    /// Goes on with another file of the damaged bag.
    pub fn next_file(&mut self) {
        self.repeated.clear();
    }

    /// Takes a message that is repeated at the head of a file. Returns false if the bag does not have it yet.
    pub fn repeat(
        &mut self,
        topic: &Topic,
        header: &MessageHeader,
        data: &[u8],
    ) -> Result<bool, WriteError> {
        let known = self.known.get(&topic.name);
        if !known.is_some_and(|known| known.contains(&identity(header, data))) {
            return Ok(false);
        }
        if let Some(writer) = &mut self.writer {
            let id = writer.add_topic(topic)?;
            self.repeated.push((id, *header, data.to_vec()));
        }
        Ok(true)
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
        if topic.qos.durable && self.remembered < MOST {
            let known = match self.known.get_mut(&topic.name) {
                Some(known) => known,
                None => self.known.entry(topic.name.clone()).or_default(),
            };
            self.remembered += usize::from(known.insert(identity(header, data)));
        }
        Ok(())
    }
}

fn identity(header: &MessageHeader, data: &[u8]) -> Identity {
    let (publish_time, sequence) = (header.publish_time, header.sequence);
    (publish_time, sequence, data.len(), crc32fast::hash(data))
}
