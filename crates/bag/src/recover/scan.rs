//! Splits a file that may be damaged into its records and what lies between them.
//!
//! A chunk is accepted if its checksum matches. The length of any other record is believed only if it ends where another
//! record starts. Behind damage, the scan continues at the next place where a record starts beyond doubt.

use mcap::{
    MAGIC,
    records::{ChunkHeader, Record, op},
};

use super::LeftOut;
use crate::{
    BagError,
    read::{MAX_CHUNK_LENGTH, MAX_RECORD_LENGTH, Source, unpack},
    record::{self, CHUNK_TIMES, MESSAGE_HEADER, parse},
};

/// Length of an operation code and the length of a body, which precede each body.
const PREFIX: u64 = record::PREFIX as u64;

/// Longest name of a known compression.
const NAME: usize = 4;

/// Bytes searched at once.
const WINDOW: usize = 64 << 10;

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
                if let Some(piece) = self.chunk(start, opcode, end)? {
                    return Ok(Some(piece));
                }
                if self.is_followed(end)? {
                    self.position = end;
                    match self.record(start, opcode, end)? {
                        None => continue,
                        piece => return Ok(piece),
                    }
                }
            }
            return Ok(match self.search(start + 1)? {
                Some(next) => Some(self.damage(start, next, "no record")),
                None => self.cut(start)?,
            });
        }
        Ok(None)
    }

    /// A record that is not a chunk, if it is of use, or the end of the data.
    fn record(&mut self, start: u64, opcode: u8, end: u64) -> Result<Option<Piece>, BagError> {
        let offset = start + PREFIX;
        let length = end - offset;
        Ok(match opcode {
            op::DATA_END if length == 4 => {
                self.position = self.source.size;
                None
            }
            // It may be an index with a damaged operation code.
            op::MESSAGE if self.chunked => Some(self.damage(start, end, "a record between chunks")),
            op::SCHEMA | op::CHANNEL | op::METADATA | op::MESSAGE => {
                if length > MAX_RECORD_LENGTH as u64 {
                    let reason = format!("a record of more than {MAX_RECORD_LENGTH} bytes");
                    return Ok(Some(self.damage(start, end, reason)));
                }
                let body = self.source.bytes(offset, length)?;
                Some(Piece::Record {
                    opcode,
                    offset,
                    body,
                })
            }
            op::HEADER | op::MESSAGE_INDEX | 0x80.. => None,
            op::ATTACHMENT => Some(self.damage(start, end, "an attachment")),
            _ => Some(self.damage(start, end, "no record")),
        })
    }

    /// The chunk at `start`, or `None` if there is none. The operation code may be damaged if the checksum matches.
    fn chunk(&mut self, start: u64, opcode: u8, end: u64) -> Result<Option<Piece>, BagError> {
        let Some((header, data)) = self.chunk_header(start, end)? else {
            return Ok(None);
        };
        let followed = self.is_followed(end)?;
        let in_vain = !followed && self.wasted > self.source.size;
        let reason = if header.compressed_size > MAX_CHUNK_LENGTH as u64 || in_vain {
            format!("a chunk of {} bytes", header.compressed_size)
        } else {
            let packed = self.source.bytes(data, header.compressed_size)?;
            match unpack(&header, &packed) {
                Ok(records) => {
                    self.position = end;
                    self.chunked = true;
                    return Ok(Some(Piece::Chunk {
                        offset: start,
                        header,
                        records,
                    }));
                }
                Err(error) => error.to_string(),
            }
        };
        if opcode != op::CHUNK {
            return Ok(None);
        }
        self.chunked = true;
        let next = if followed {
            end
        } else {
            self.wasted += header.compressed_size;
            self.search(start + 1)?.unwrap_or(self.source.size)
        };
        let mut piece = self.damage(start, next, reason);
        let (first, last) = (header.message_start_time, header.message_end_time);
        if let Piece::Damage(place) = &mut piece
            && first <= last
        {
            place.times = Some((first, last));
        }
        Ok(Some(piece))
    }

    /// The end of the file, which lies within a record. `None` if the record could not have held a message.
    fn cut(&mut self, start: u64) -> Result<Option<Piece>, BagError> {
        let opcode = self.source.bytes(start, 1)?;
        let harmless = [
            op::SCHEMA,
            op::CHANNEL,
            op::MESSAGE_INDEX,
            op::METADATA,
            op::DATA_END,
            op::FOOTER,
        ];
        let is_harmless = opcode.iter().all(|opcode| harmless.contains(opcode));
        let end = self.source.size;
        let damage = self.damage(start, end, "the file ends within a record");
        Ok((!is_harmless).then_some(damage))
    }

    /// The part up to `end`, behind which the scan goes on.
    fn damage(&mut self, offset: u64, end: u64, reason: impl Into<String>) -> Piece {
        self.position = end;
        Piece::Damage(LeftOut {
            offset,
            bytes: end - offset,
            reason: reason.into(),
            times: None,
        })
    }

    /// The first place from `from` on where a record starts beyond doubt.
    fn search(&self, from: u64) -> Result<Option<u64>, BagError> {
        let mut at = from;
        while at + PREFIX <= self.source.size {
            let window = self.source.bytes(at, WINDOW as u64)?;
            // No length takes more than five bytes.
            let candidates = window.windows(PREFIX as usize).enumerate();
            let candidates = candidates.filter(|(_, bytes)| {
                (op::SCHEMA..=op::DATA_END).contains(&bytes[0]) && bytes[6..] == [0; 3]
            });
            for (index, _) in candidates {
                if self.is_certain(at + index as u64)? {
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
            op::METADATA if length <= WINDOW as u64 => {
                parse(op::METADATA, &self.source.bytes(start + PREFIX, length)?).is_ok()
            }
            // Chunks hold such records too, which are damaged with their chunk. Three in a row are certain.
            op::MESSAGE if !self.chunked && length >= MESSAGE_HEADER as u64 => {
                match self.prefix(end)? {
                    Some((_, next)) => self.is_followed(next)?,
                    None => end == self.source.size,
                }
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
