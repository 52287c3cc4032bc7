//! A file of the recovered bag.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

use mcap::{
    McapError, WriteOptions, Writer,
    records::{Channel, MessageHeader, Metadata},
    write::NoSeek,
};

use super::{
    RecoverError,
    latched::{Head, Latched},
};
use crate::{Durability, PROFILE, Qos, channel_key, read::Schema};

type Mcap = Writer<NoSeek<BufWriter<File>>>;

/// A file that is made with its first record.
pub(super) struct Output<'a> {
    path: PathBuf,
    mcap: Option<Mcap>,
    /// Compression of the damaged file's chunks.
    compression: Option<String>,
    /// Name of each channel's topic, and a flag that tells if it is latched.
    topics: BTreeMap<u16, (String, bool)>,
    head: Option<Head>,
    latched: &'a mut Latched,
}

impl<'a> Output<'a> {
    /// `latched` are the messages in the files before.
    pub fn new(path: PathBuf, latched: &'a mut Latched) -> Self {
        Self {
            path,
            mcap: None,
            compression: None,
            topics: BTreeMap::new(),
            head: None,
            latched,
        }
    }

    /// Sets the compression, unless it is known.
    pub fn compress(&mut self, compression: String) {
        self.compression.get_or_insert(compression);
    }

    pub fn has_topic(&self, channel: u16) -> bool {
        self.topics.contains_key(&channel)
    }

    pub fn add_topic(&mut self, channel: Channel, schema: &Schema) -> Result<(), RecoverError> {
        let Channel {
            id,
            topic,
            message_encoding,
            metadata,
            ..
        } = channel;
        self.write(|mcap| {
            mcap.add_schema_with_id(schema.id, &schema.name, &schema.encoding, &schema.data)?;
            mcap.add_channel_with_id(id, schema.id, &topic, &message_encoding, &metadata)?;
            Ok(())
        })?;
        let qos = metadata.get(channel_key::QOS);
        let qos = qos.and_then(|text| Qos::from_yaml(text).ok());
        let latched = qos.is_some_and(|qos| qos.durability == Durability::TransientLocal);
        self.topics.insert(id, (topic, latched));
        Ok(())
    }

    /// Writes a message of a channel that was added.
    pub fn message(&mut self, header: MessageHeader, data: &[u8]) -> Result<(), RecoverError> {
        if let Some(head) = &mut self.head {
            let (topic, _) = &self.topics[&header.channel_id];
            let Some((header, data)) = head.hold(topic, (header, data.to_vec()), self.latched)
            else {
                return Ok(());
            };
            self.end_head()?;
            return self.put(header, &data);
        }
        self.put(header, data)
    }

    fn put(&mut self, header: MessageHeader, data: &[u8]) -> Result<(), RecoverError> {
        if let (topic, true) = &self.topics[&header.channel_id] {
            self.latched.add(topic, &header, data);
        }
        self.write(|mcap| mcap.write_to_known_channel(&header, data))
    }

    /// Announces repeated messages, as many of each topic.
    pub fn begin_head(&mut self, counts: BTreeMap<String, u64>) {
        self.head = Some(Head::new(counts));
    }

    fn end_head(&mut self) -> Result<(), RecoverError> {
        let Some(head) = self.head.take() else {
            return Ok(());
        };
        let (record, mut messages) = head.finish();
        if let Some(record) = record {
            self.metadata(record)?;
        }
        messages.try_for_each(|(header, data)| self.put(header, &data))
    }

    pub fn metadata(&mut self, record: Metadata) -> Result<(), RecoverError> {
        self.write(|mcap| mcap.write_metadata(&record))
    }

    pub fn attachment(&mut self, attachment: &mcap::Attachment<'_>) -> Result<(), RecoverError> {
        self.write(|mcap| mcap.attach(attachment))
    }

    /// Completes the file.
    pub fn finish(mut self) -> Result<(), RecoverError> {
        self.end_head()?;
        self.write(|mcap| mcap.finish().map(drop))?;
        if let Some(mcap) = self.mcap {
            let mut buffer = mcap.into_inner().into_inner();
            buffer.flush().map_err(RecoverError::write(&self.path))?;
        }
        Ok(())
    }

    /// Removes the file.
    pub fn abandon(self) -> Result<(), RecoverError> {
        if let Some(mcap) = self.mcap {
            drop(mcap);
            fs::remove_file(&self.path).map_err(RecoverError::write(&self.path))?;
        }
        Ok(())
    }

    fn write(
        &mut self,
        write: impl FnOnce(&mut Mcap) -> Result<(), McapError>,
    ) -> Result<(), RecoverError> {
        let mcap = match &mut self.mcap {
            Some(mcap) => mcap,
            none => none.insert(create(&self.path, self.compression.as_deref())?),
        };
        write(mcap).map_err(RecoverError::mcap(&self.path))
    }
}

fn create(path: &Path, compression: Option<&str>) -> Result<Mcap, RecoverError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(RecoverError::write(folder))?;
    }
    let file = File::create_new(path).map_err(RecoverError::write(path))?;
    let compression = match compression {
        Some("lz4") => Some(mcap::Compression::Lz4),
        Some("zstd") | None => Some(mcap::Compression::Zstd),
        Some(_) => None,
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
