//! One MCAP file that is being written.
//!
//! Space for the rest of the file is reserved before anything is taken, so that the file can be completed on a full disk.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File},
    io::{self, BufWriter, Seek, Write},
    os::unix::fs::MetadataExt,
    path::PathBuf,
};

use mcap::{
    McapError, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
    write::NoSeek,
};

use super::{
    Compression,
    sink::{Reserve, Sink},
};
use crate::{
    PROFILE, SERIALIZATION_FORMAT, Topic, channel_key,
    record::{MESSAGE_HEADER, PREFIX},
    times::{Times, widen},
};

/// Size of chunks (bytes), before compression. Larger messages are chunks of their own.
pub(crate) const CHUNK: u64 = 1 << 20;

/// Memory of the entry of a chunk in the index, and of each of its channels; more than they take in the file.
const INDEX: usize = 160;
const INDEXED_CHANNEL: usize = 40;

/// More bytes than any record but a message takes without its texts, lists and data.
const RECORD: u64 = 160;

/// Bytes of a message's entry in the index of its chunk, and at most of what a channel adds to a chunk.
const MESSAGE_ENTRY: u64 = 8 + 8;
const CHANNEL_ENTRY: u64 = 64;

/// Bytes of the end of the data, statistics, summary offsets, footer and magic, and of a chunk without its records.
const END: u64 = 2048;

type Mcap = Writer<NoSeek<BufWriter<Sink>>>;

pub(crate) struct McapWriter {
    pub path: PathBuf,
    /// `None` once the file has its end.
    mcap: Option<Mcap>,
    reserve: Reserve,
    chunk_size: u64,
    /// Checksums of the definitions in the file.
    schemas: BTreeSet<u32>,
    /// Channels with messages in the chunk that is being filled.
    channels: BTreeSet<u16>,
    taken: Content,
    /// The part of `taken` that is written, and the length of the file with it.
    written: Content,
    length: u64,
    /// Memory of the index of the file (bytes).
    pub index_memory: usize,
    /// Bytes of the messages in the chunk that is being filled, and at most of its other records and its index.
    messages: u64,
    others: u64,
    /// Bytes at most of the definitions in the summary.
    definitions: u64,
    /// Bytes at most of the description of the bag, which is written into the file and beside it.
    pub description: u64,
}

/// Messages of a file.
#[derive(Clone, Default)]
pub(crate) struct Content {
    /// Number of messages of each channel, which are counted from 1.
    pub counts: Vec<u64>,
    /// First and last log time (ns).
    pub times: Times,
}

impl McapWriter {
    /// Creates the file, which must not exist, with room for a description of the bag of so many bytes. If it reserves
    /// no space, it cannot be completed on a full disk.
    pub fn create(
        path: PathBuf,
        compression: Compression,
        chunk_size: u64,
        description: u64,
        reserves: bool,
    ) -> io::Result<Self> {
        let file = File::create_new(&path)?;
        // Held until the file is closed or the process has ended, so that nobody recovers a bag that is being written.
        // A file system without locks does without.
        let _ = file.try_lock();
        let reserve = Reserve::new(file, reserves);
        let mut writer = Self {
            path,
            mcap: None,
            reserve,
            chunk_size,
            schemas: BTreeSet::new(),
            channels: BTreeSet::new(),
            taken: Content::default(),
            written: Content::default(),
            length: 0,
            index_memory: 0,
            messages: 0,
            others: 0,
            definitions: 0,
            description,
        };
        let begun = writer.begin(compression);
        if begun.is_err() {
            let _ = fs::remove_file(&writer.path);
        }
        begun.map(|()| writer)
    }

    fn begin(&mut self, compression: Compression) -> io::Result<()> {
        self.hold()?;
        let options = WriteOptions::new()
            .profile(PROFILE)
            .library(concat!("lgvi ", env!("CARGO_PKG_VERSION")))
            .compression(match compression {
                Compression::None => None,
                Compression::Lz4 => Some(mcap::Compression::Lz4),
                Compression::Zstd => Some(mcap::Compression::Zstd),
            })
            .compression_level(1)
            .compression_threads(0)
            .chunk_size(None)
            .disable_seeking(true);
        let sink = Sink {
            file: self.reserve.file.clone(),
            failed: false,
        };
        let mcap = options.create(NoSeek::new(BufWriter::new(sink)));
        self.mcap = Some(mcap.map_err(io_error)?);
        self.flush()
    }

    /// Adds a topic under the id of its channel. Adding it again has no effect.
    pub fn add_topic(&mut self, channel: u16, topic: &Topic, qos: &str) -> io::Result<()> {
        let (name, hash) = (&topic.name, &topic.type_hash);
        let texts = [
            &topic.type_name,
            &topic.definition_encoding,
            &topic.definition,
        ];
        let mut hasher = crc32fast::Hasher::new();
        for text in texts {
            hasher.update(text.as_bytes());
        }
        if self.schemas.insert(hasher.finalize()) {
            self.define(texts.map(String::len).iter().sum());
        }
        self.define(name.len() + qos.len() + hash.len());
        self.hold()?;
        let metadata = BTreeMap::from([
            (channel_key::QOS.to_owned(), qos.to_owned()),
            (channel_key::TYPE_HASH.to_owned(), hash.clone()),
        ]);
        self.with(|mcap| {
            let [type_name, encoding, definition] = texts;
            let schema = mcap.add_schema(type_name, encoding, definition.as_bytes())?;
            mcap.add_channel_with_id(channel, schema, name, SERIALIZATION_FORMAT, &metadata)
        })?;
        let channels = self.taken.counts.len().max(channel.into());
        self.taken.counts.resize(channels, 0);
        Ok(())
    }

    /// Makes room for a definition, which is in a chunk and in the summary.
    fn define(&mut self, texts: usize) {
        let bytes = RECORD + texts as u64;
        self.others += bytes;
        self.definitions += bytes;
    }

    pub fn write(&mut self, header: &MessageHeader, data: &[u8]) -> io::Result<()> {
        let message = (PREFIX + MESSAGE_HEADER + data.len()) as u64;
        if !self.channels.is_empty() && self.messages + message > self.chunk_size {
            self.flush()?;
        }
        self.messages += message;
        self.others += MESSAGE_ENTRY;
        if self.channels.insert(header.channel_id) {
            self.others += CHANNEL_ENTRY;
        }
        self.hold()?;
        self.with(|mcap| mcap.write_to_known_channel(header, data))?;
        self.taken.counts[usize::from(header.channel_id) - 1] += 1;
        widen(&mut self.taken.times, header.log_time);
        Ok(())
    }

    /// Makes sure that the file can be completed.
    fn hold(&mut self) -> io::Result<()> {
        // lz4 and zstd add less than a 128th to what they cannot compress.
        let chunk = self.messages + self.others;
        let index = self.definitions + self.index_memory as u64;
        let bytes = chunk + chunk / 128 + index + END + 2 * self.description;
        self.reserve.hold(self.length, bytes)
    }

    /// Writes the chunk that is being filled, if it has messages.
    pub fn finish_chunk(&mut self) -> io::Result<()> {
        match self.channels.is_empty() {
            true => Ok(()),
            false => self.flush(),
        }
    }

    /// Writes everything.
    fn flush(&mut self) -> io::Result<()> {
        self.with(Writer::flush)?;
        self.length = (&*self.reserve.file).stream_position()?;
        if self.messages + self.others > 0 {
            let channels = std::mem::take(&mut self.channels).len();
            self.index_memory += INDEX + INDEXED_CHANNEL * channels;
            self.messages = 0;
            self.others = 0;
            self.written.clone_from(&self.taken);
        }
        Ok(())
    }

    /// Writes the chunk that is being filled, and behind it a metadata record.
    pub fn write_metadata(
        &mut self,
        name: &str,
        metadata: BTreeMap<String, String>,
    ) -> io::Result<()> {
        let texts = metadata
            .iter()
            .map(|(key, value)| 8 + key.len() + value.len());
        let record = RECORD + texts.sum::<usize>() as u64;
        self.index_memory += INDEX;
        self.others += record;
        self.hold()?;
        self.others -= record;
        let name = name.to_owned();
        let record = Metadata { name, metadata };
        self.with(|mcap| mcap.write_metadata(&record))?;
        self.flush()
    }

    /// Completes the file by a last metadata record and the summary, and gives its size.
    pub fn close(&mut self, name: &str, metadata: BTreeMap<String, String>) -> io::Result<u64> {
        let name = name.to_owned();
        let record = Metadata { name, metadata };
        self.with(|mcap| {
            mcap.write_metadata(&record)?;
            mcap.finish().map(drop)
        })?;
        if let Some(mcap) = self.mcap.take() {
            mcap.into_inner().into_inner().flush()?;
        }
        self.length = (&*self.reserve.file).stream_position()?;
        self.reserve.release(self.length)?;
        Ok(self.length)
    }

    fn with<T>(&mut self, act: impl FnOnce(&mut Mcap) -> Result<T, McapError>) -> io::Result<T> {
        let Some(mcap) = &mut self.mcap else {
            return Err(io::Error::other("the file has its end"));
        };
        act(mcap).map_err(io_error)
    }

    /// Bytes of the file so far, if it has a chunk.
    pub fn size(&self) -> u64 {
        self.written.times.map_or(0, |_| self.length)
    }

    /// The messages in the chunks written.
    pub fn written(&self) -> &Content {
        &self.written
    }

    /// Checks that the file is still where it was made.
    pub fn check_place(&self) -> io::Result<()> {
        let there = fs::metadata(&self.path)?;
        let here = self.reserve.file.metadata()?;
        if (there.dev(), there.ino()) != (here.dev(), here.ino()) {
            let text = "another file has taken its place";
            return Err(io::Error::new(io::ErrorKind::NotFound, text));
        }
        Ok(())
    }

    /// Cuts the file behind the last complete chunk.
    pub fn abandon(&mut self) {
        // The crate's writer would write the end of the file when it is dropped.
        drop(self.mcap.take().map(Writer::into_inner));
        let _ = self.reserve.release(self.length);
    }
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
