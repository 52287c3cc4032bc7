//! Chunks: the messages between two writes to the file.

use std::io::{self, Write};

use mcap::records::op;

use super::{
    Compression,
    encode::{self, MessageHeader, PREFIX},
};

/// Bytes of a message in the index of its chunk: log time and offset.
const ENTRY: usize = 8 + 8;

/// Bytes of a buffer that are kept for the next chunk: those of long messages are not.
const KEPT: usize = 4 << 20;

/// A chunk that is being filled. Its memory is used again for the next.
#[derive(Default)]
pub(crate) struct Chunk {
    records: Vec<u8>,
    /// Bytes of schemas and channels among them.
    definitions: usize,
    /// First and last log time (ns).
    times: Option<(u64, u64)>,
    /// By channel: log time and offset in the chunk of each message.
    entries: Vec<Vec<u8>>,
    /// Channels that have entries.
    channels: Vec<u16>,
}

/// A chunk as it is written to the file.
pub(crate) struct Sealed<'a> {
    /// The record up to the compressed messages.
    pub head: &'a [u8],
    pub data: &'a [u8],
    /// The message indexes.
    pub tail: &'a [u8],
    pub index: ChunkIndex,
}

/// What the file's summary has of a chunk.
pub(crate) struct ChunkIndex {
    /// First and last log time (ns).
    pub times: (u64, u64),
    pub offset: u64,
    pub length: u64,
    compressed: u64,
    uncompressed: u64,
    /// Number of messages of each channel that has any.
    pub counts: Box<[(u16, u32)]>,
}

impl Chunk {
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Bytes of its messages.
    pub fn len(&self) -> usize {
        self.records.len() - self.definitions
    }

    /// Adds schemas or channels.
    pub fn define(&mut self, records: &[u8]) {
        self.definitions += records.len();
        self.records.extend_from_slice(records);
    }

    pub fn push(&mut self, header: MessageHeader, data: &[u8]) {
        let index = usize::from(header.channel);
        if index >= self.entries.len() {
            self.entries.resize_with(index + 1, Vec::new);
        }
        let entries = &mut self.entries[index];
        if entries.is_empty() {
            self.channels.push(header.channel);
        }
        encode::u64(entries, header.log_time);
        encode::u64(entries, self.records.len() as u64);
        encode::message(&mut self.records, header, data);
        let (first, last) = self.times.unwrap_or((header.log_time, header.log_time));
        self.times = Some((first.min(header.log_time), last.max(header.log_time)));
    }

    /// The chunk as bytes of the file, of which it will be at `offset`.
    pub fn seal<'a>(&'a mut self, sealer: &'a mut Sealer, offset: u64) -> io::Result<Sealed<'a>> {
        let times = self.times.unwrap_or_default();
        let data = sealer.compressor.compress(&self.records)?;
        let (head, tail) = (&mut sealer.head, &mut sealer.tail);
        let uncompressed = self.records.len() as u64;

        head.clear();
        encode::record(head, op::CHUNK, |out| {
            encode::u64(out, times.0);
            encode::u64(out, times.1);
            encode::u64(out, uncompressed);
            encode::u32(out, crc32fast::hash(&self.records));
            encode::bytes(out, sealer.name.as_bytes());
            encode::u64(out, data.len() as u64);
        });
        let body = (head.len() - PREFIX + data.len()) as u64;
        head[1..PREFIX].copy_from_slice(&body.to_le_bytes());

        self.channels.sort_unstable();
        tail.clear();
        for &channel in &self.channels {
            encode::record(tail, op::MESSAGE_INDEX, |out| {
                encode::u16(out, channel);
                encode::bytes(out, &self.entries[usize::from(channel)]);
            });
        }
        let counts = self.channels.iter().map(|&channel| {
            let entries = &self.entries[usize::from(channel)];
            (channel, (entries.len() / ENTRY) as u32)
        });
        let index = ChunkIndex {
            times,
            offset,
            length: (head.len() + data.len()) as u64,
            compressed: data.len() as u64,
            uncompressed,
            counts: counts.collect(),
        };
        Ok(Sealed {
            head,
            data,
            tail,
            index,
        })
    }

    pub fn clear(&mut self) {
        self.records.clear();
        self.definitions = 0;
        self.records.shrink_to(KEPT);
        for channel in self.channels.drain(..) {
            self.entries[usize::from(channel)].clear();
        }
        self.times = None;
    }
}

impl ChunkIndex {
    /// Bytes that it holds in memory.
    pub fn memory(&self) -> usize {
        size_of::<Self>() + size_of_val(&*self.counts)
    }

    /// Appends the record of the summary.
    pub fn encode(&self, out: &mut Vec<u8>, compression: &str) {
        let indexes = self.offset + self.length;
        let mut end = indexes;
        encode::record(out, op::CHUNK_INDEX, |out| {
            encode::u64(out, self.times.0);
            encode::u64(out, self.times.1);
            encode::u64(out, self.offset);
            encode::u64(out, self.length);
            encode::sized(out, |out| {
                for &(channel, count) in &self.counts {
                    encode::u16(out, channel);
                    encode::u64(out, end);
                    end += (PREFIX + 2 + 4 + ENTRY * count as usize) as u64;
                }
            });
            encode::u64(out, end - indexes);
            encode::bytes(out, compression.as_bytes());
            encode::u64(out, self.compressed);
            encode::u64(out, self.uncompressed);
        });
    }
}

/// Makes bytes of the file from chunks, in buffers that are used again.
pub(crate) struct Sealer {
    /// The compression's name in MCAP.
    pub name: &'static str,
    compressor: Compressor,
    head: Vec<u8>,
    tail: Vec<u8>,
}

enum Compressor {
    None,
    Lz4(Vec<u8>),
    Zstd(zstd::bulk::Compressor<'static>, Vec<u8>),
}

impl Sealer {
    pub fn new(compression: Compression) -> io::Result<Self> {
        let (name, compressor) = match compression {
            Compression::None => ("", Compressor::None),
            Compression::Lz4 => ("lz4", Compressor::Lz4(Vec::new())),
            Compression::Zstd => {
                let fastest = zstd::bulk::Compressor::new(1)?;
                ("zstd", Compressor::Zstd(fastest, Vec::new()))
            }
        };
        Ok(Self {
            name,
            compressor,
            head: Vec::new(),
            tail: Vec::new(),
        })
    }
}

impl Compressor {
    fn compress<'a>(&'a mut self, records: &'a [u8]) -> io::Result<&'a [u8]> {
        match self {
            Self::None => Ok(records),
            Self::Lz4(out) => {
                out.clear();
                out.shrink_to(KEPT);
                // The chunk has a checksum of its own.
                let mut encoder = lz4::EncoderBuilder::new()
                    .block_checksum(lz4::liblz4::BlockChecksum::NoBlockChecksum)
                    .checksum(lz4::ContentChecksum::NoChecksum)
                    .build(out)?;
                encoder.write_all(records)?;
                let (out, ended) = encoder.finish();
                ended.map(|()| &out[..])
            }
            Self::Zstd(compressor, out) => {
                out.clear();
                out.shrink_to(KEPT);
                out.reserve(zstd::zstd_safe::compress_bound(records.len()));
                compressor.compress_to_buffer(records, out)?;
                Ok(out)
            }
        }
    }
}
