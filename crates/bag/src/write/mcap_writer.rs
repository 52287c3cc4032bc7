//! One MCAP file that is being written.
//!
//! Space for the rest of the file is reserved before anything is taken, so that the file can be completed on a full disk.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File},
    io::{self, BufWriter, Write},
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
};

use mcap::{
    McapError, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
    write::NoSeek,
};

use super::{
    Compression,
    room::{Room, message_length},
    sink::{self, Reserve, Sink},
};
use crate::{PROFILE, SERIALIZATION_FORMAT, Topic, channel_key};

/// Size of chunks (bytes), before compression. Larger messages are chunks of their own.
pub(crate) const CHUNK: u64 = 1 << 20;

/// Memory of the entry of a chunk in the index, and of each of its channels.
const INDEX: usize = 160;
const INDEXED_CHANNEL: usize = 40;

type Mcap = Writer<NoSeek<BufWriter<Sink>>>;

pub(crate) struct McapWriter {
    path: PathBuf,
    /// `None` once the file has its end.
    mcap: Option<Mcap>,
    reserve: Reserve,
    room: Room,
    chunk_size: u64,
    /// Checksums of the definitions in the file.
    schemas: BTreeSet<u32>,
    /// Channels with messages in the chunk that is being filled.
    channels: BTreeSet<u16>,
    taken: Content,
    /// The part of `taken` that is written, and the length of the file with it.
    written: Content,
    length: u64,
    chunks: usize,
    index_memory: usize,
}

/// Messages of a file.
#[derive(Clone, Default)]
struct Content {
    /// Number of messages of each channel, which are counted from 1.
    counts: Vec<u64>,
    /// First and last log time (ns).
    times: Option<(u64, u64)>,
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
        let (sink, mut reserve) = sink::open(file, reserves);
        let room = Room::new(description);
        let compression = match compression {
            Compression::None => None,
            Compression::Lz4 => Some(mcap::Compression::Lz4),
            Compression::Zstd => Some(mcap::Compression::Zstd),
        };
        let options = WriteOptions::new()
            .profile(PROFILE)
            .library(concat!("lgvi ", env!("CARGO_PKG_VERSION")))
            .compression(compression)
            .compression_level(1)
            .compression_threads(0)
            .chunk_size(None)
            .disable_seeking(true);
        let held = reserve.hold(room.bytes());
        let created = held.and_then(|()| {
            let mut mcap = options
                .create(NoSeek::new(BufWriter::new(sink)))
                .map_err(io_error)?;
            mcap.flush().map_err(io_error)?;
            Ok(mcap)
        });
        match created {
            Ok(mcap) => Ok(Self {
                length: reserve.written(),
                path,
                mcap: Some(mcap),
                reserve,
                room,
                chunk_size,
                schemas: BTreeSet::new(),
                channels: BTreeSet::new(),
                taken: Content::default(),
                written: Content::default(),
                chunks: 0,
                index_memory: 0,
            }),
            Err(error) => {
                let _ = fs::remove_file(&path);
                Err(error)
            }
        }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a topic under the id of its channel. Adding it again has no effect.
    pub fn add_topic(&mut self, channel: u16, topic: &Topic, qos: &str) -> io::Result<()> {
        let Topic {
            name,
            type_name,
            type_hash,
            definition,
            definition_encoding,
            ..
        } = topic;
        let mut room = self.room.clone();
        let mut hasher = crc32fast::Hasher::new();
        for text in [type_name, definition_encoding, definition] {
            hasher.update(text.as_bytes());
        }
        if self.schemas.insert(hasher.finalize()) {
            room.define(type_name.len() + definition_encoding.len() + definition.len());
        }
        room.define(name.len() + qos.len() + type_hash.len() + 64);
        self.reserve.hold(room.bytes())?;
        self.room = room;
        let metadata = BTreeMap::from([
            (channel_key::QOS.to_owned(), qos.to_owned()),
            (channel_key::TYPE_HASH.to_owned(), type_hash.clone()),
        ]);
        self.with(|mcap| {
            let schema = mcap.add_schema(type_name, definition_encoding, definition.as_bytes())?;
            mcap.add_channel_with_id(channel, schema, name, SERIALIZATION_FORMAT, &metadata)
        })?;
        let channels = self.taken.counts.len().max(channel.into());
        self.taken.counts.resize(channels, 0);
        Ok(())
    }

    /// Makes room for a description of the bag of so many bytes.
    pub fn describe(&mut self, bytes: u64) {
        self.room.describe(bytes);
    }

    pub fn write(&mut self, header: &MessageHeader, data: &[u8]) -> io::Result<()> {
        if !self.channels.is_empty()
            && self.room.messages() + message_length(data) > self.chunk_size
        {
            self.finish_chunk()?;
        }
        let channel = header.channel_id;
        let mut room = self.room.clone();
        room.message(data, !self.channels.contains(&channel));
        self.reserve.hold(room.bytes())?;
        self.room = room;
        self.channels.insert(channel);
        self.with(|mcap| mcap.write_to_known_channel(header, data))?;
        self.taken.add(channel, header.log_time);
        Ok(())
    }

    /// Writes the chunk that is being filled, if it has messages.
    pub fn finish_chunk(&mut self) -> io::Result<()> {
        if self.channels.is_empty() {
            return Ok(());
        }
        self.flush()
    }

    /// Writes everything.
    fn flush(&mut self) -> io::Result<()> {
        self.with(Writer::flush)?;
        self.length = self.reserve.written();
        if !self.room.is_empty() {
            let channels = std::mem::take(&mut self.channels).len();
            self.room.end_chunk(channels);
            self.index_memory += INDEX + INDEXED_CHANNEL * channels;
            self.chunks += usize::from(channels > 0);
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
        let mut room = self.room.clone();
        let record = room.metadata(texts.sum());
        self.reserve.hold(room.bytes() + record)?;
        self.room = room;
        self.index_memory += INDEX;
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
        self.length = self.reserve.written();
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
    pub fn written(&self) -> u64 {
        if self.chunks == 0 { 0 } else { self.length }
    }

    /// Memory of the index of the file (bytes).
    pub fn index_memory(&self) -> usize {
        self.index_memory
    }

    /// First and last log time (ns) of the chunks written.
    pub fn times(&self) -> Option<(u64, u64)> {
        self.written.times
    }

    /// Number of messages of each channel, which are counted from 1, in the chunks written.
    pub fn counts(&self) -> &[u64] {
        &self.written.counts
    }

    /// Checks that the file is still where it was made.
    pub fn check_place(&self) -> io::Result<()> {
        let there = fs::metadata(&self.path)?;
        let here = self.reserve.file().metadata()?;
        if (there.dev(), there.ino()) != (here.dev(), here.ino()) {
            return Err(io::Error::new(
                io::ErrorKind::NotFound,
                "another file has taken its place",
            ));
        }
        Ok(())
    }

    /// Returns true if the file was deleted or moved.
    pub fn is_gone(&self) -> bool {
        use io::ErrorKind::{NotADirectory, NotFound};
        let place = self.check_place();
        place.is_err_and(|error| matches!(error.kind(), NotADirectory | NotFound))
    }

    /// Cuts the file behind the last complete chunk.
    pub fn abandon(&mut self) {
        // The crate's writer would write the end of the file when it is dropped.
        drop(self.mcap.take().map(Writer::into_inner));
        let _ = self.reserve.release(self.length);
    }
}

impl Content {
    fn add(&mut self, channel: u16, log_time: u64) {
        self.counts[usize::from(channel) - 1] += 1;
        let (first, last) = self.times.unwrap_or((log_time, log_time));
        self.times = Some((first.min(log_time), last.max(log_time)));
    }
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
