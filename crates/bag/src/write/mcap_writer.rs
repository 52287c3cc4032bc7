//! One MCAP file that is being written.
//!
//! Nothing of it is in the file but what is complete: each write of a chunk either succeeds as a whole, or is cut off
//! again when the file is closed. The crate mcap keeps to itself what that needs.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io,
    os::unix::fs::{FileExt, MetadataExt},
    path::{Path, PathBuf},
};

use crc32fast::Hasher;
use mcap::{MAGIC, records::op};

use super::{
    Compression,
    catalog::Catalog,
    chunk::{Chunk, ChunkIndex, Sealer},
    encode::{self, MessageHeader},
    summary::{MetadataIndex, Summary},
};
use crate::{PROFILE, Topic};

/// Messages are gathered into chunks of this size (bytes), before compression; larger ones are chunks of their own.
pub(crate) const CHUNK: u64 = 1 << 20;

pub(crate) struct McapWriter {
    path: PathBuf,
    file: File,
    /// Up to where the file is written and whole.
    end: u64,
    /// Checksum of the file up to there; unknown after something was cut off.
    checksum: Option<Hasher>,
    catalog: Catalog,
    chunk_size: usize,
    chunk: Chunk,
    /// Bytes of the catalog's schemas and channels that are in a chunk too.
    in_chunks: (usize, usize),
    sealer: Sealer,
    chunks: Vec<ChunkIndex>,
    /// Bytes that `chunks` holds.
    index_memory: usize,
    metadata: Vec<MetadataIndex>,
}

impl McapWriter {
    /// Creates the file, which must not exist, with the topics that are known.
    pub fn create(
        path: PathBuf,
        compression: Compression,
        chunk_size: usize,
        catalog: Catalog,
    ) -> io::Result<Self> {
        let sealer = Sealer::new(compression)?;
        let file = File::create_new(&path)?;
        // Held until the file is closed or the process has ended, so that nobody recovers a bag that is being written.
        // File systems without locks do without.
        let _ = file.try_lock();
        let mut writer = Self {
            file,
            path,
            end: 0,
            checksum: Some(Hasher::new()),
            catalog: Catalog::default(),
            chunk_size,
            chunk: Chunk::default(),
            in_chunks: (0, 0),
            sealer,
            chunks: Vec::new(),
            index_memory: 0,
            metadata: Vec::new(),
        };
        let mut head = MAGIC.to_vec();
        encode::record(&mut head, op::HEADER, |out| {
            encode::bytes(out, PROFILE.as_bytes());
            encode::bytes(out, concat!("lgvi ", env!("CARGO_PKG_VERSION")).as_bytes());
        });
        let written = writer.append(&[&head, catalog.schemas(), catalog.channels()]);
        writer.catalog = catalog;
        if written.is_err() {
            let _ = writer.remove();
        }
        written.map(|()| writer)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its topics, for the next file.
    pub fn into_catalog(self) -> Catalog {
        self.catalog
    }

    /// Adds a topic and gives the id of its channel; none if there are too many.
    pub fn add_topic(&mut self, topic: &Topic, qos: String) -> io::Result<Option<u16>> {
        let known = self.catalog.schemas().len();
        let described = self.catalog.channels().len();
        let channel = self.catalog.add(topic, qos);
        let new = [
            &self.catalog.schemas()[known..],
            &self.catalog.channels()[described..],
        ];
        append(&self.file, &mut self.end, &mut self.checksum, &new)?;
        Ok(channel)
    }

    pub fn write(&mut self, header: MessageHeader, data: &[u8]) -> io::Result<()> {
        if !self.chunk.is_empty()
            && self.chunk.len() + encode::message_length(data) > self.chunk_size
        {
            self.finish_chunk()?;
        }
        self.define();
        self.chunk.push(header, data);
        Ok(())
    }

    /// Puts definitions into the chunk that are in none yet, where a checksum covers them: those at the head of the file
    /// have none before its end is written.
    fn define(&mut self) {
        let (schemas, channels) = (self.catalog.schemas(), self.catalog.channels());
        let known = (schemas.len(), channels.len());
        if self.in_chunks != known {
            self.chunk.define(&schemas[self.in_chunks.0..]);
            self.chunk.define(&channels[self.in_chunks.1..]);
            self.in_chunks = known;
        }
    }

    /// Writes the chunk that is being filled, if it has messages.
    pub fn finish_chunk(&mut self) -> io::Result<()> {
        if self.chunk.is_empty() {
            return Ok(());
        }
        let sealed = self.chunk.seal(&mut self.sealer, self.end)?;
        let parts = [sealed.head, sealed.data, sealed.tail];
        append(&self.file, &mut self.end, &mut self.checksum, &parts)?;
        self.index_memory += sealed.index.memory();
        self.chunks.push(sealed.index);
        self.chunk.clear();
        Ok(())
    }

    /// Writes a metadata record; chunks that are not finished come after it.
    pub fn write_metadata(
        &mut self,
        name: &'static str,
        texts: &BTreeMap<String, String>,
    ) -> io::Result<()> {
        let mut record = Vec::new();
        let index = MetadataIndex::encode(&mut record, self.end, name, texts);
        self.append(&[&record])?;
        self.metadata.push(index);
        Ok(())
    }

    /// Completes the file by a last metadata record and the summary of what is written of it, and gives its size. The
    /// writer stays as it is, so that this can be tried again.
    pub fn close(&self, name: &'static str, texts: &BTreeMap<String, String>) -> io::Result<u64> {
        let mut tail = Vec::new();
        let last = MetadataIndex::encode(&mut tail, self.end, name, texts);
        let checksum = self.checksum.clone().map_or(0, |mut checksum| {
            checksum.update(&tail);
            checksum.finalize()
        });
        encode::record(&mut tail, op::DATA_END, |out| encode::u32(out, checksum));
        Summary {
            catalog: &self.catalog,
            compression: self.sealer.name,
            chunks: &self.chunks,
            metadata: self.metadata.iter().chain([&last]),
            counts: &self.counts(),
            times: self.times(),
        }
        .encode(&mut tail, self.end);
        self.file.write_all_at(&tail, self.end)?;
        Ok(self.end + tail.len() as u64)
    }

    /// Bytes of the file so far, if it has a chunk.
    pub fn written(&self) -> u64 {
        if self.chunks.is_empty() { 0 } else { self.end }
    }

    /// Bytes of memory that the index of the file takes.
    pub fn index_memory(&self) -> usize {
        self.index_memory + size_of_val(&*self.metadata)
    }

    /// First and last log time (ns) of the chunks written.
    pub fn times(&self) -> Option<(u64, u64)> {
        let times = self.chunks.iter().map(|chunk| chunk.times);
        times.reduce(|(first, last), (start, end)| (first.min(start), last.max(end)))
    }

    /// Number of messages of each channel, which are counted from 1, in the chunks written.
    pub fn counts(&self) -> Vec<u64> {
        let mut counts = vec![0; usize::from(self.catalog.channel_count())];
        for &(channel, count) in self.chunks.iter().flat_map(|chunk| &chunk.counts) {
            counts[usize::from(channel) - 1] += u64::from(count);
        }
        counts
    }

    /// Cuts off what an unfinished write has left, and of the chunks before it the last ones until at least so many bytes
    /// are free; false if there are too few.
    pub fn cut(&mut self, bytes: u64) -> io::Result<bool> {
        self.chunk.clear();
        let end = self.end;
        while end - self.end < bytes {
            let Some(last) = self.chunks.pop() else {
                break;
            };
            self.index_memory -= last.memory();
            self.end = last.offset;
            self.checksum = None;
        }
        self.metadata.retain(|index| index.offset < self.end);
        self.file.set_len(self.end)?;
        Ok(end - self.end >= bytes)
    }

    /// Whether the file is still where it was made.
    pub fn check_place(&self) -> io::Result<()> {
        let there = fs::metadata(&self.path)?;
        let here = self.file.metadata()?;
        if (there.dev(), there.ino()) != (here.dev(), here.ino()) {
            return Err(io::Error::new(
                io::ErrorKind::NotFound,
                "another file has taken its place",
            ));
        }
        Ok(())
    }

    /// Whether the file was deleted or moved.
    pub fn is_gone(&self) -> bool {
        use io::ErrorKind::{NotADirectory, NotFound};
        let place = self.check_place();
        place.is_err_and(|error| matches!(error.kind(), NotADirectory | NotFound))
    }

    /// Removes the file.
    pub fn remove(&self) -> io::Result<()> {
        fs::remove_file(&self.path)
    }

    fn append(&mut self, parts: &[&[u8]]) -> io::Result<()> {
        append(&self.file, &mut self.end, &mut self.checksum, parts)
    }
}

fn append(
    file: &File,
    end: &mut u64,
    checksum: &mut Option<Hasher>,
    parts: &[&[u8]],
) -> io::Result<()> {
    let mut offset = *end;
    for part in parts {
        file.write_all_at(part, offset)?;
        offset += part.len() as u64;
    }
    *end = offset;
    if let Some(checksum) = checksum {
        for part in parts {
            checksum.update(part);
        }
    }
    Ok(())
}
