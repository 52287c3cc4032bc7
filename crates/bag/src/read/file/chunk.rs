//! Chunks, and what is read at once.

use std::io::Read;

use mcap::records::op;

use super::{MAX_CHUNK_LENGTH, walk};
use crate::{
    Damage,
    records::{ChunkHeader, MessageHeader},
};

/// Memory that is reserved on a chunk's word.
const BELIEVED: usize = 4 << 20;

/// Decompresses the records of a chunk and checks their checksum.
pub(crate) fn unpack(header: &ChunkHeader, packed: impl Read) -> Result<Vec<u8>, Damage> {
    let expected = usize::try_from(header.length).unwrap_or(usize::MAX);
    if expected > MAX_CHUNK_LENGTH {
        return Err(Damage::TooLong {
            opcode: op::CHUNK,
            length: header.length,
            limit: MAX_CHUNK_LENGTH,
        });
    }
    let mut bytes = Vec::with_capacity(expected.min(BELIEVED));
    let packed = packed.take(header.packed_length);
    let limit = header.length;
    match &*header.compression {
        "" | "none" => packed.take(limit).read_to_end(&mut bytes),
        "zstd" => zstd::Decoder::new(packed)
            .and_then(|decoder| decoder.take(limit).read_to_end(&mut bytes)),
        "lz4" => lz4::Decoder::new(packed)
            .and_then(|decoder| decoder.take(limit).read_to_end(&mut bytes)),
        other => {
            return Err(Damage::Compression {
                found: other.to_owned(),
            });
        }
    }
    .map_err(|source| Damage::Unpack { source })?;
    if bytes.len() != expected {
        let found = bytes.len();
        return Err(Damage::ChunkLength { expected, found });
    }
    if header.checksum != 0 {
        let (saved, calculated) = (header.checksum, crc32fast::hash(&bytes));
        if saved != calculated {
            return Err(Damage::Checksum {
                of: "chunk",
                saved,
                calculated,
            });
        }
    }
    Ok(bytes)
}

/// Messages read at once, in the order of their log times; those of one log time in the order of the file.
pub(crate) struct Batch {
    bytes: Vec<u8>,
    entries: Vec<Entry>,
    next: usize,
}

/// A message's place in the bytes.
struct Entry {
    log_time: u64,
    start: usize,
    end: usize,
}

impl Batch {
    /// The messages, but for the first `repeated` ones, that are wanted.
    pub fn new(
        bytes: Vec<u8>,
        mut repeated: usize,
        mut wanted: impl FnMut(&MessageHeader) -> Result<bool, Damage>,
    ) -> Result<Self, Damage> {
        let mut entries: Vec<Entry> = Vec::new();
        let mut ascending = true;
        let mut offset = 0;
        while offset < bytes.len() {
            let (opcode, start, end) = walk::split(&bytes, offset)?;
            offset = end;
            if opcode != op::MESSAGE {
                continue;
            }
            let (header, _) = MessageHeader::parse(&bytes[start..end])?;
            if repeated > 0 {
                repeated -= 1;
            } else if wanted(&header)? {
                let log_time = header.log_time;
                ascending &= entries.last().is_none_or(|last| last.log_time <= log_time);
                entries.push(Entry {
                    log_time,
                    start,
                    end,
                });
            }
        }
        if !ascending {
            entries.sort_by_key(|entry| entry.log_time);
        }
        Ok(Self {
            bytes,
            entries,
            next: 0,
        })
    }

    /// Bytes of memory that it takes.
    pub fn memory(&self) -> usize {
        self.bytes.len() + self.entries.len() * size_of::<Entry>()
    }

    /// Log time of the next message.
    pub fn next_time(&self) -> Option<u64> {
        self.entries.get(self.next).map(|entry| entry.log_time)
    }

    /// The next message.
    pub fn pop(&mut self) -> Option<(MessageHeader, &[u8])> {
        let entry = self.entries.get(self.next)?;
        self.next += 1;
        MessageHeader::parse(&self.bytes[entry.start..entry.end]).ok()
    }
}
