//! A file of the recovered bag.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

use mcap::{
    McapError, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
    write::NoSeek,
};

use super::{
    RecoverError,
    chunk::Packing,
    definitions::Topic,
    identities::{Identities, Identity},
    repeated::Repeated,
};
use crate::{PROFILE, records::Channel};

pub(super) struct Output {
    path: PathBuf,
    mcap: Option<Writer<NoSeek<BufWriter<File>>>>,
    /// As the damaged file has it.
    pub packing: Option<Packing>,
    /// Topics of channels that are latched ones.
    channels: BTreeMap<u16, Option<String>>,
    /// Messages at the head, of which it is not yet known whether the bag has them already.
    head: Option<Repeated>,
    /// Messages written that are marked as repeated, by topic.
    pub repeated: BTreeMap<String, u64>,
    /// What the bag has of latched topics.
    identities: Identities,
}

impl Output {
    /// A file of a bag that has messages of latched topics in the files before it.
    pub fn new(path: PathBuf, identities: Identities) -> Self {
        Self {
            path,
            mcap: None,
            packing: None,
            channels: BTreeMap::new(),
            head: None,
            repeated: BTreeMap::new(),
            identities,
        }
    }

    /// Adds a topic's channel with its schema, unless it has been added before.
    pub fn add_topic(&mut self, topic: &Topic) -> Result<(), RecoverError> {
        let Topic { channel, schema } = topic;
        if self.channels.contains_key(&channel.id) {
            return Ok(());
        }
        let latched = self.identities.add_topic(channel);
        let topic = latched.then(|| channel.topic.clone());
        self.channels.insert(channel.id, topic);
        self.write(|mcap| {
            mcap.add_schema_with_id(schema.id, &schema.name, &schema.encoding, &schema.data)?;
            let Channel {
                id,
                topic,
                encoding,
                metadata,
                ..
            } = channel;
            mcap.add_channel_with_id(*id, schema.id, topic, encoding, metadata)?;
            Ok(())
        })
    }

    /// Writes a message of a channel that was added.
    pub fn message(
        &mut self,
        topic: &str,
        header: MessageHeader,
        data: &[u8],
    ) -> Result<(), RecoverError> {
        if let Some(head) = &mut self.head {
            let identity = Identity::new(&header, data);
            let is_known = self.identities.contain(topic, identity);
            if head.take(topic, header, data, is_known) {
                return Ok(());
            }
            self.end_head()?;
        }
        self.put(header, data)
    }

    fn put(&mut self, header: MessageHeader, data: &[u8]) -> Result<(), RecoverError> {
        if let Some(Some(topic)) = self.channels.get(&header.channel_id) {
            let identity = Identity::new(&header, data);
            self.identities.add(topic, identity);
        }
        self.write(|mcap| mcap.write_to_known_channel(&header, data))
    }

    /// The next messages are repeated ones, so many of each topic, as far as they are there.
    pub fn begin_head(&mut self, counts: BTreeMap<String, u64>) {
        self.head = Some(Repeated::new(counts));
    }

    /// No repeated messages follow.
    pub fn end_head(&mut self) -> Result<(), RecoverError> {
        let Some(head) = self.head.take() else {
            return Ok(());
        };
        if let Some(record) = head.record() {
            self.metadata(record)?;
        }
        for (header, data) in head.marked.into_iter().chain(head.others) {
            self.put(header, &data)?;
        }
        self.repeated = head.found;
        Ok(())
    }

    /// Writes a record of metadata.
    pub fn metadata(&mut self, record: Metadata) -> Result<(), RecoverError> {
        self.write(|mcap| mcap.write_metadata(&record))
    }

    /// Writes an attachment.
    pub fn attachment(&mut self, attachment: &mcap::Attachment<'_>) -> Result<(), RecoverError> {
        self.write(|mcap| mcap.attach(attachment))
    }

    /// Writes the summary. Gives what the bag has of latched topics.
    pub fn finish(mut self) -> Result<Identities, RecoverError> {
        self.write(|mcap| mcap.finish().map(drop))?;
        if let Some(mcap) = self.mcap {
            let mut buffer = mcap.into_inner().into_inner();
            buffer.flush().map_err(RecoverError::write(&self.path))?;
        }
        Ok(self.identities)
    }

    /// Removes what has been written.
    pub fn abandon(self) -> Result<Identities, RecoverError> {
        if self.mcap.is_some() {
            drop(self.mcap);
            fs::remove_file(&self.path).map_err(RecoverError::write(&self.path))?;
        }
        Ok(self.identities)
    }

    fn write(
        &mut self,
        write: impl FnOnce(&mut Writer<NoSeek<BufWriter<File>>>) -> Result<(), McapError>,
    ) -> Result<(), RecoverError> {
        let mcap = match &mut self.mcap {
            Some(mcap) => mcap,
            none => none.insert(create(&self.path, self.packing)?),
        };
        write(mcap).map_err(RecoverError::mcap(&self.path))
    }
}

fn create(
    path: &Path,
    packing: Option<Packing>,
) -> Result<Writer<NoSeek<BufWriter<File>>>, RecoverError> {
    let file = File::create_new(path).map_err(RecoverError::write(path))?;
    let compression = match packing {
        Some(Packing::None) => None,
        Some(Packing::Lz4) => Some(mcap::Compression::Lz4),
        Some(Packing::Zstd) | None => Some(mcap::Compression::Zstd),
    };
    WriteOptions::new()
        .profile(PROFILE)
        .library(concat!("lgvi ", env!("CARGO_PKG_VERSION")))
        .compression(compression)
        .compression_level(1)
        .compression_threads(0)
        .disable_seeking(true)
        .create(NoSeek::new(BufWriter::new(file)))
        .map_err(RecoverError::mcap(path))
}
