//! Splits a file that may be damaged into its records and what lies between them.
//!
//! A chunk is accepted if its checksum matches. The length of any other record is believed only if it ends where another
//! record starts. Behind damage, the scan continues at the next chunk or metadata record.

use mcap::{
    MAGIC,
    records::{ChunkHeader, Record, op},
};

use super::LeftOut;
use crate::{
    BagError,
    read::{MAX_CHUNK_LENGTH, MAX_RECORD_LENGTH, Source, unpack},
    record::{self, CHUNK_TIMES, parse},
};

/// Length of an operation code and the length of a body, which precede each body.
const PREFIX: u64 = record::PREFIX as u64;

/// Longest name of a known compression.
const NAME: usize = 4;

/// Bytes searched at once.
const WINDOW: u64 = 64 << 10;

/// A part of the file.
pub(super) enum Piece {
    /// A definition, a metadata record or a message outside of chunks.
    Record {
        opcode: u8,
        offset: u64,
        body: Vec<u8>,
    },
    /// The records of an intact chunk.
    Chunk {
        offset: u64,
        header: ChunkHeader,
        records: Vec<u8>,
    },
    /// A damaged part.
    Damage(LeftOut),
}

pub(super) struct Scanner<'a> {
    source: &'a Source,
    position: u64,
    /// True if the file has chunks.
    chunked: bool,
    /// Bytes read of chunks whose end could not be found. Bounds the time for a file made of overlapping chunks.
    wasted: u64,
}

impl<'a> Scanner<'a> {
    pub fn new(source: &'a Source) -> Self {
        Self {
            source,
            position: MAGIC.len() as u64,
            chunked: false,
            wasted: 0,
        }
    }

    /// The next part of the data section, or `None` at its end.
    pub fn next(&mut self) -> Result<Option<Piece>, BagError> {
        while self.position < self.source.size {
            let start = self.position;
            if let Some((opcode, end)) = self.prefix(start)? {
                // Its operation code may be damaged.
                if let Some((header, data)) = self.chunk_header(start, end)? {
                    return self.chunk(start, header, data).map(Some);
                }
                if self.is_followed(end)? {
                    self.position = end;
                    match self.record(start, opcode, end)? {
                        None => continue,
                        piece => return Ok(piece),
                    }
                }
            }
            return self.gap(start);
        }
        Ok(None)
    }

    /// A record that is not a chunk, if it is of use, or the end of the data.
    fn record(&mut self, start: u64, opcode: u8, end: u64) -> Result<Option<Piece>, BagError> {
        let offset = start + PREFIX;
        let length = end - offset;
        let reason = match opcode {
            op::DATA_END if length == 4 => {
                self.position = self.source.size;
                return Ok(None);
            }
            // It may be an index with a damaged operation code.
            op::MESSAGE if self.chunked => "a record between chunks",
            op::SCHEMA | op::CHANNEL | op::METADATA | op::MESSAGE
                if length <= MAX_RECORD_LENGTH as u64 =>
            {
                let body = self.source.bytes(offset, length)?;
                return Ok(Some(Piece::Record {
                    opcode,
                    offset,
                    body,
                }));
            }
            op::HEADER | op::MESSAGE_INDEX | 0x80.. => return Ok(None),
            op::ATTACHMENT => "an attachment",
            op::SCHEMA | op::CHANNEL | op::METADATA | op::MESSAGE => "a record of more than 64 MiB",
            _ => "no record",
        };
        Ok(Some(self.damage(start, end, reason.to_owned())))
    }

    /// The chunk at `start` with data at `data`, if its checksum matches.
    fn chunk(&mut self, start: u64, header: ChunkHeader, data: u64) -> Result<Piece, BagError> {
        let length = header.compressed_size;
        let end = data + length;
        let followed = self.is_followed(end)?;
        self.chunked = true;
        let in_vain = !followed && self.wasted > self.source.size;
        let reason = if length > MAX_CHUNK_LENGTH as u64 || in_vain {
            format!("a chunk of {length} bytes")
        } else {
            match unpack(&header, &self.source.bytes(data, length)?) {
                Ok(records) => {
                    self.position = end;
                    return Ok(Piece::Chunk {
                        offset: start,
                        header,
                        records,
                    });
                }
                Err(damage) => damage.to_string(),
            }
        };
        let next = if followed {
            end
        } else {
            self.wasted += length;
            self.search(start + 1)?.unwrap_or(self.source.size)
        };
        let (first, last) = (header.message_start_time, header.message_end_time);
        let mut piece = self.damage(start, next, reason);
        if let Piece::Damage(place) = &mut piece {
            place.times = Some((first, last)).filter(|_| first <= last);
        }
        Ok(piece)
    }

    /// What lies between `start`, where no record is, and the next one. Nothing if the file ends in one that could not have
    /// held a message.
    fn gap(&mut self, start: u64) -> Result<Option<Piece>, BagError> {
        if let Some(next) = self.search(start + 1)? {
            return Ok(Some(self.damage(start, next, "no record".to_owned())));
        }
        let harmless = [
            op::SCHEMA,
            op::CHANNEL,
            op::MESSAGE_INDEX,
            op::METADATA,
            op::DATA_END,
            op::FOOTER,
        ];
        let opcode = self.source.bytes(start, 1)?;
        let is_harmless = opcode.iter().all(|opcode| harmless.contains(opcode));
        let reason = "the file ends within a record".to_owned();
        let damage = self.damage(start, self.source.size, reason);
        Ok((!is_harmless).then_some(damage))
    }

    /// The part up to `end`, behind which the scan goes on.
    fn damage(&mut self, offset: u64, end: u64, reason: String) -> Piece {
        self.position = end;
        Piece::Damage(LeftOut {
            offset,
            bytes: end - offset,
            reason,
            times: None,
        })
    }

    /// The first place from `from` on where a chunk or a metadata record starts beyond doubt, or the data ends.
    fn search(&self, from: u64) -> Result<Option<u64>, BagError> {
        let mut at = from;
        while at + PREFIX <= self.source.size {
            let window = self.source.bytes(at, WINDOW)?;
            for (index, bytes) in window.windows(PREFIX as usize).enumerate() {
                // No length takes more than five bytes.
                let may_start = [op::CHUNK, op::METADATA, op::DATA_END].contains(&bytes[0]);
                if may_start && bytes[6..] == [0; 3] && self.is_certain(at + index as u64)? {
                    return Ok(Some(at + index as u64));
                }
            }
            at += (window.len() as u64).saturating_sub(PREFIX - 1).max(1);
        }
        Ok(None)
    }

    fn is_certain(&self, start: u64) -> Result<bool, BagError> {
        let Some((opcode, end)) = self.prefix(start)? else {
            return Ok(false);
        };
        if !self.is_followed(end)? {
            return Ok(false);
        }
        let length = end - start - PREFIX;
        Ok(match opcode {
            op::CHUNK => {
                let chunk = self.chunk_header(start, end)?;
                chunk.is_some_and(|(it, _)| it.message_start_time <= it.message_end_time)
            }
            op::DATA_END => length == 4,
            _ if length <= WINDOW => {
                parse(op::METADATA, &self.source.bytes(start + PREFIX, length)?).is_ok()
            }
            _ => false,
        })
    }

    /// Operation code and end of the record at `start`, or `None` if the file ends within its prefix.
    fn prefix(&self, start: u64) -> Result<Option<(u8, u64)>, BagError> {
        let prefix = record::prefix(&self.source.bytes(start, PREFIX)?);
        let end = |length| (start + PREFIX).saturating_add(length);
        Ok(prefix.map(|(opcode, length)| (opcode, end(length))))
    }

    /// Returns true if a record can start at `at`, or the file ends there.
    fn is_followed(&self, at: u64) -> Result<bool, BagError> {
        if at > self.source.size {
            return Ok(false);
        }
        let bytes = self.source.bytes(at, PREFIX)?;
        Ok(match bytes[..] {
            [opcode, .., a, b, c] if bytes.len() == record::PREFIX => {
                matches!(opcode, op::HEADER..=op::DATA_END | 0x80..) && [a, b, c] == [0; 3]
            }
            _ => bytes.is_empty() || bytes == MAGIC || bytes[0] <= op::DATA_END,
        })
    }

    /// The header of the chunk from `start` to `end`, and where its data starts, if the header agrees with that.
    fn chunk_header(&self, start: u64, end: u64) -> Result<Option<(ChunkHeader, u64)>, BagError> {
        if end > self.source.size {
            return Ok(None);
        }
        let most = CHUNK_TIMES + 4 + NAME + 8;
        let mut head = self.source.bytes(start + PREFIX, most as u64)?;
        let name = head.get(CHUNK_TIMES).copied().unwrap_or(u8::MAX);
        head.truncate(CHUNK_TIMES + 4 + usize::from(name) + 8);
        let data = start + PREFIX + head.len() as u64;
        // The records behind the header are not read here.
        let Some(size) = head.last_chunk_mut() else {
            return Ok(None);
        };
        let compressed_size = u64::from_le_bytes(std::mem::take(size));
        let Ok(Record::Chunk { mut header, .. }) = parse(op::CHUNK, &head) else {
            return Ok(None);
        };
        header.compressed_size = compressed_size;
        let is_known = ["", "none", "lz4", "zstd"].contains(&&*header.compression);
        let agrees = data.checked_add(compressed_size) == Some(end);
        Ok((is_known && agrees).then_some((header, data)))
    }
}
