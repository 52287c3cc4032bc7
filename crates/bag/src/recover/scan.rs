//! Splits a file that may be damaged into its records and what lies between them.
//!
//! A chunk is accepted if its checksum matches. The length of any other record is believed only if it ends where another
//! record starts. Behind damage, the scan continues at the next place where a record starts beyond doubt.

use mcap::{
    MAGIC,
    records::{ChunkHeader, Record, op},
};

use super::{LIMIT, PACKED_LIMIT, RecoverError, source::Source};
use crate::{
    read::unpack,
    record::{CHUNK_TIMES, parse, prefix as split},
};

/// Length of an operation code and the length of a body, which precede each body.
const PREFIX: u64 = 1 + 8;

/// Longest name of a known compression.
const NAME: usize = 4;

/// Length of an entry of a message index.
const INDEX_ENTRY: u64 = 8 + 8;

/// Bytes searched at once.
const WINDOW: usize = 64 << 10;

/// A part of the file.
pub(super) enum Piece {
    /// A record outside of chunks.
    Record {
        opcode: u8,
        offset: u64,
        body: Vec<u8>,
    },
    /// An intact chunk.
    Chunk {
        offset: u64,
        compression: String,
        /// The records in it.
        records: Vec<u8>,
        /// True if a checksum covers them.
        checked: bool,
    },
    /// A damaged part.
    Damage {
        offset: u64,
        bytes: u64,
        reason: String,
        /// First and last log time (ns) of a damaged chunk.
        times: Option<(u64, u64)>,
    },
    /// The index of the messages of one channel in the chunk before it.
    Index { messages: u64 },
}

/// Operation code and body length of a record.
#[derive(Clone, Copy)]
struct Prefix {
    opcode: u8,
    length: u64,
}

pub(super) struct Scanner {
    position: u64,
    /// True if the file has chunks.
    chunked: bool,
    /// True if the file has messages outside of chunks.
    loose: bool,
    /// Bytes read of chunks whose end could not be found. Bounds the time for a file made of overlapping chunks.
    wasted: u64,
}

impl Scanner {
    pub fn new() -> Self {
        Self {
            position: MAGIC.len() as u64,
            chunked: false,
            loose: false,
            wasted: 0,
        }
    }

    /// The next part of the data section, or `None` at its end.
    pub fn next(&mut self, source: &Source) -> Result<Option<Piece>, RecoverError> {
        let start = self.position;
        if start >= source.size {
            return Ok(None);
        }
        let Some(prefix) = prefix(source, start)? else {
            let opcode = source.bytes(start, 1)?;
            return Ok(self.cut(source, start, opcode.first().copied()));
        };
        let end = (start + PREFIX).saturating_add(prefix.length);
        if end <= source.size {
            if let Some(piece) = self.chunk(source, start, prefix)? {
                return Ok(Some(piece));
            }
            if is_followed(source, end)? {
                self.position = end;
                return self.record(source, start, prefix);
            }
        }
        match self.search(source, start + 1)? {
            Some(next) => {
                self.position = next;
                Ok(Some(damage(start, next, "no record")))
            }
            None => Ok(self.cut(source, start, Some(prefix.opcode))),
        }
    }

    /// A record that is not a chunk, with a length that is right.
    fn record(
        &mut self,
        source: &Source,
        start: u64,
        Prefix { opcode, length }: Prefix,
    ) -> Result<Option<Piece>, RecoverError> {
        let body = start + PREFIX;
        let is_index = length >= 6 && is_index(&source.bytes(body, 6)?, length);
        Ok(Some(match opcode {
            op::DATA_END if length == 4 => {
                self.position = source.size;
                return Ok(None);
            }
            op::MESSAGE_INDEX if is_index => Piece::Index {
                messages: (length - 6) / INDEX_ENTRY,
            },
            // No message lies behind a chunk: this is an index with a damaged operation code.
            op::MESSAGE if is_index && self.chunked && !self.loose => Piece::Index { messages: 0 },
            op::HEADER..=op::METADATA_INDEX if length > LIMIT as u64 => {
                let reason = format!("a record of more than {LIMIT} bytes");
                damage(start, self.position, reason)
            }
            op::CHUNK | op::MESSAGE_INDEX => damage(start, self.position, "no record"),
            op::HEADER..=op::METADATA_INDEX => {
                self.loose |= opcode == op::MESSAGE;
                Piece::Record {
                    opcode,
                    offset: body,
                    body: source.bytes(body, length as usize)?,
                }
            }
            0x80.. => return self.next(source),
            _ => damage(start, self.position, "no record"),
        }))
    }

    /// The chunk at `start`, or `None` if there is none. The operation code may be damaged if the checksum matches.
    fn chunk(
        &mut self,
        source: &Source,
        start: u64,
        prefix: Prefix,
    ) -> Result<Option<Piece>, RecoverError> {
        let Some((header, header_length)) = chunk_header(source, start, prefix)? else {
            return Ok(None);
        };
        let end = start + PREFIX + prefix.length;
        let followed = is_followed(source, end)?;
        let is_chunk = prefix.opcode == op::CHUNK;
        let times = Some((header.message_start_time, header.message_end_time))
            .filter(|(first, last)| first <= last);
        let in_vain = !followed && self.wasted > source.size;
        let reason = if header.compressed_size > PACKED_LIMIT as u64 || in_vain {
            format!("a chunk of {} bytes", header.compressed_size)
        } else {
            let data = start + PREFIX + header_length;
            let packed = source.bytes(data, header.compressed_size as usize)?;
            match unpack(&header, &packed[..]) {
                Ok(records) => {
                    self.position = end;
                    self.chunked = true;
                    return Ok(Some(Piece::Chunk {
                        offset: start,
                        compression: header.compression,
                        records,
                        checked: header.uncompressed_crc != 0,
                    }));
                }
                Err(error) => error.to_string(),
            }
        };
        if !is_chunk {
            return Ok(None);
        }
        self.chunked = true;
        self.position = if followed {
            end
        } else {
            self.wasted += header.compressed_size;
            self.search(source, start + 1)?.unwrap_or(source.size)
        };
        Ok(Some(Piece::Damage {
            offset: start,
            bytes: self.position - start,
            reason,
            times,
        }))
    }

    /// The end of the file, which lies within a record. `None` if the record could not have held a message.
    fn cut(&mut self, source: &Source, start: u64, opcode: Option<u8>) -> Option<Piece> {
        self.position = source.size;
        let harmless = [
            op::SCHEMA,
            op::CHANNEL,
            op::MESSAGE_INDEX,
            op::METADATA,
            op::DATA_END,
            op::FOOTER,
        ];
        let holds_messages = opcode.is_none_or(|opcode| !harmless.contains(&opcode));
        holds_messages.then(|| damage(start, source.size, "the file ends within a record"))
    }

    /// The first place from `from` on where a record starts beyond doubt.
    fn search(&self, source: &Source, from: u64) -> Result<Option<u64>, RecoverError> {
        let mut at = from;
        while at + PREFIX <= source.size {
            let window = source.bytes(at, WINDOW)?;
            // No length takes more than five bytes.
            let candidates = window.windows(PREFIX as usize).enumerate();
            let candidates = candidates.filter(|(_, bytes)| {
                (op::SCHEMA..=op::DATA_END).contains(&bytes[0]) && bytes[6..] == [0; 3]
            });
            for (index, _) in candidates {
                if self.is_certain(source, at + index as u64)? {
                    return Ok(Some(at + index as u64));
                }
            }
            at += (window.len() as u64).saturating_sub(PREFIX - 1).max(1);
        }
        Ok(None)
    }

    fn is_certain(&self, source: &Source, start: u64) -> Result<bool, RecoverError> {
        let Some(prefix) = prefix(source, start)? else {
            return Ok(false);
        };
        let body = start + PREFIX;
        let end = body.saturating_add(prefix.length);
        if end > source.size || !is_followed(source, end)? {
            return Ok(false);
        }
        Ok(match prefix.opcode {
            op::CHUNK => chunk_header(source, start, prefix)?
                .is_some_and(|(header, _)| header.message_start_time <= header.message_end_time),
            op::MESSAGE_INDEX => is_index(&source.bytes(body, 6)?, prefix.length),
            op::DATA_END => prefix.length == 4,
            op::METADATA if prefix.length <= WINDOW as u64 => {
                parse(op::METADATA, &source.bytes(body, prefix.length as usize)?).is_ok()
            }
            // Chunks hold such records too, which are damaged with their chunk. Three in a row are certain.
            op::MESSAGE | op::SCHEMA | op::CHANNEL if self.loose || !self.chunked => {
                prefix.length >= 8
                    && match self::prefix(source, end)? {
                        Some(next) => {
                            let next = (end + PREFIX).saturating_add(next.length);
                            next <= source.size && is_followed(source, next)?
                        }
                        None => end == source.size,
                    }
            }
            _ => false,
        })
    }
}

fn damage(offset: u64, end: u64, reason: impl Into<String>) -> Piece {
    Piece::Damage {
        offset,
        bytes: end - offset,
        reason: reason.into(),
        times: None,
    }
}

/// The prefix at `start`, or `None` if the file ends before it does.
fn prefix(source: &Source, start: u64) -> Result<Option<Prefix>, RecoverError> {
    let bytes = source.bytes(start, PREFIX as usize)?;
    Ok(split(&bytes).map(|(opcode, length)| Prefix { opcode, length }))
}

/// Returns true if a record can start at `at`, or the file ends there.
fn is_followed(source: &Source, at: u64) -> Result<bool, RecoverError> {
    let bytes = source.bytes(at, PREFIX as usize)?;
    Ok(match bytes[..] {
        [opcode, .., a, b, c] if bytes.len() == PREFIX as usize => {
            matches!(opcode, op::HEADER..=op::DATA_END | 0x80..) && [a, b, c] == [0; 3]
        }
        _ => bytes.is_empty() || bytes == MAGIC || bytes[0] <= op::DATA_END,
    })
}

/// Returns true if the first six bytes of a body are those of a message index: a channel, and the length of the rest.
fn is_index(head: &[u8], length: u64) -> bool {
    let entries = head.last_chunk().map(|bytes| u32::from_le_bytes(*bytes));
    entries.is_some_and(|entries| {
        head.len() == 6
            && u64::from(entries) + 6 == length
            && u64::from(entries).is_multiple_of(INDEX_ENTRY)
    })
}

/// The header of the chunk at `start` with its length, if the header agrees with the record's length.
fn chunk_header(
    source: &Source,
    start: u64,
    prefix: Prefix,
) -> Result<Option<(ChunkHeader, u64)>, RecoverError> {
    let mut head = source.bytes(start + PREFIX, CHUNK_TIMES + 4 + NAME + 8)?;
    let name = head
        .get(CHUNK_TIMES)
        .map_or(usize::MAX, |length| usize::from(*length));
    let length = (CHUNK_TIMES + 4).saturating_add(name).saturating_add(8);
    if head.len() < length {
        return Ok(None);
    }
    head.truncate(length);
    // The records behind the header are not read here.
    let (_, size) = head.split_at_mut(length - 8);
    let packed = size
        .first_chunk()
        .map_or(0, |size| u64::from_le_bytes(*size));
    size.fill(0);
    let Ok(Record::Chunk { mut header, .. }) = parse(op::CHUNK, &head) else {
        return Ok(None);
    };
    header.compressed_size = packed;
    let is_known = ["", "none", "lz4", "zstd"].contains(&&*header.compression);
    let agrees = (length as u64).checked_add(packed) == Some(prefix.length);
    Ok((is_known && agrees).then_some((header, length as u64)))
}
