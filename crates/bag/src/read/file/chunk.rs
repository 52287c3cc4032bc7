//! Chunks, and what is read at once.

use std::{borrow::Cow, io::Read, ops::Range};

use mcap::records::{ChunkHeader, MessageHeader, op};

use super::{MAX_CHUNK_LENGTH, MAX_RECORD_LENGTH, source::ZSTD_MAGIC};
use crate::{
    Damage,
    error::{agree, limited},
    record,
};

/// Memory that is reserved on a chunk's word.
const BELIEVED: usize = 4 << 20;

/// Decompresses the records of a chunk and checks their checksum.
pub(crate) fn unpack(header: &ChunkHeader, packed: &[u8]) -> Result<Vec<u8>, Damage> {
    let limit = header.uncompressed_size;
    let expected = limited(op::CHUNK, limit, MAX_CHUNK_LENGTH)?;
    let mut bytes = Vec::with_capacity(expected.min(BELIEVED));
    match &*header.compression {
        "" | "none" => packed.take(limit).read_to_end(&mut bytes),
        "zstd" => zstd::Decoder::with_buffer(packed)
            .and_then(|decoder| decoder.take(limit).read_to_end(&mut bytes)),
        "lz4" => lz4::Decoder::new(packed)
            .and_then(|decoder| decoder.take(limit).read_to_end(&mut bytes)),
        other => {
            let expected = "expected none, \"lz4\" or \"zstd\"; convert the file: mcap compress";
            return Err(Damage(format!(
                "chunk compression is {other:?}, {expected}"
            )));
        }
    }
    .map_err(|error| Damage(format!("cannot be decompressed: {error}")))?;
    agree("length of the chunk", expected, bytes.len())?;
    let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(&bytes));
    if saved == 0 || saved == calculated {
        return Ok(bytes);
    }
    let text = format!("checksum of the chunk is {calculated:08x}, expected {saved:08x}");
    Err(Damage(text))
}

/// Payload of a message, decompressed where rosbag2 has compressed the message by itself.
pub(crate) fn unpacked(data: &[u8]) -> Result<Cow<'_, [u8]>, Damage> {
    if !data.starts_with(ZSTD_MAGIC) {
        return Ok(data.into());
    }
    let mut bytes = Vec::new();
    let limit = MAX_RECORD_LENGTH as u64;
    zstd::Decoder::with_buffer(data)
        .and_then(|decoder| decoder.take(limit + 1).read_to_end(&mut bytes))
        .map_err(|error| Damage(format!("cannot be decompressed: {error}")))?;
    limited(op::MESSAGE, bytes.len() as u64, MAX_RECORD_LENGTH)?;
    Ok(bytes.into())
}

/// Messages read at once, in the order of their log times; those of one log time in the order of the file.
pub(crate) struct Batch {
    bytes: Vec<u8>,
    /// Log time and place of each message.
    entries: Vec<(u64, Range<usize>)>,
    next: usize,
}

impl Batch {
    /// The messages, but for the first `repeated` ones, that are wanted.
    pub fn new(
        bytes: Vec<u8>,
        mut repeated: usize,
        mut wanted: impl FnMut(&MessageHeader) -> Result<bool, Damage>,
    ) -> Result<Self, Damage> {
        let mut entries = Vec::new();
        for record in record::records(&bytes) {
            let (opcode, place) = record?;
            if opcode != op::MESSAGE {
                continue;
            }
            limited(opcode, place.len() as u64, MAX_RECORD_LENGTH)?;
            let (header, _) = record::message(&bytes[place.clone()])?;
            if repeated > 0 {
                repeated -= 1;
            } else if wanted(&header)? {
                entries.push((header.log_time, place));
            }
        }
        // Takes time in proportion to their number where they are sorted.
        entries.sort_by_key(|(log_time, _)| *log_time);
        Ok(Self {
            bytes,
            entries,
            next: 0,
        })
    }

    /// Bytes of memory that it takes.
    pub fn memory(&self) -> usize {
        self.bytes.len() + size_of_val(&*self.entries)
    }

    /// Log time of the next message.
    pub fn next_time(&self) -> Option<u64> {
        self.entries.get(self.next).map(|(log_time, _)| *log_time)
    }

    /// The next message.
    pub fn pop(&mut self) -> Option<(MessageHeader, &[u8])> {
        let (_, place) = self.entries.get(self.next)?;
        self.next += 1;
        record::message(&self.bytes[place.clone()]).ok()
    }
}
