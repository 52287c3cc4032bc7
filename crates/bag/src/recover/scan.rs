//! Walks from record to record of a file that may be damaged.
//!
//! No length is believed unless what is behind it looks like a record too, or the record itself shows that it is right.

use mcap::{MAGIC, records::op};

use super::{
    LIMIT, RecoverError,
    chunk::ChunkHeader,
    definition_shape::{is_definition, recognize_definition},
    shape::{
        has_form, is_magic, is_message_index, marks_repeated, plausible, prefix, recognize_chunk,
    },
    source::Source,
};

/// Operation code and length before each record's body.
pub(super) const PREFIX: u64 = 1 + 8;

pub(super) const MAGIC_LENGTH: u64 = MAGIC.len() as u64;

/// A part of the file.
#[derive(Debug)]
pub(super) enum Piece {
    /// A record whose length is right.
    Record { opcode: u8, place: Place },
    /// A chunk, of which `data` are the records.
    Chunk {
        header: ChunkHeader,
        data: Place,
        /// Where the chunk record starts.
        start: u64,
        /// The file ends before the chunk does.
        cut: bool,
        /// Whether a record follows; if not, the chunk's length may be wrong.
        followed: bool,
    },
    /// What is no record.
    Damage { place: Place, cut: bool },
}

/// Where something is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub offset: u64,
    pub length: u64,
}

impl Place {
    pub fn between(offset: u64, end: u64) -> Self {
        Self {
            offset,
            length: end - offset,
        }
    }
}

pub(super) struct Scanner {
    position: u64,
    /// Whether the end of the file is there: the footer and the magic.
    pub ended: bool,
    /// Whether the data are over, and only the summary is left.
    pub in_summary: bool,
    /// Whether the file has messages outside of chunks.
    pub loose: bool,
    /// Whether it has chunks.
    chunked: bool,
}

impl Scanner {
    /// Begins behind the magic at the file's start, if that is there.
    pub fn new(source: &Source) -> Result<(Self, bool), RecoverError> {
        let (found, length) = source.peek::<{ MAGIC.len() }>(0)?;
        // One that is cut off within it is of MCAP too.
        let magic = MAGIC.starts_with(&found[..length]);
        let scanner = Self {
            position: MAGIC_LENGTH.min(source.size),
            ended: false,
            in_summary: false,
            loose: false,
            chunked: false,
        };
        Ok((scanner, magic))
    }

    /// The next part of the file.
    pub fn next(&mut self, source: &mut Source) -> Result<Option<Piece>, RecoverError> {
        let start = self.position;
        if start >= source.size {
            return Ok(None);
        }
        if self.in_summary && source.size - start == MAGIC_LENGTH && is_magic(source, start)? {
            self.ended = true;
            return Ok(None);
        }
        let piece = match self.recognize(source, start)? {
            Some(piece) => piece,
            None => self.damage(source, start)?,
        };
        self.position = match &piece {
            Piece::Record { place, .. }
            | Piece::Chunk { data: place, .. }
            | Piece::Damage { place, .. } => place.offset + place.length,
        };
        match piece {
            Piece::Record {
                opcode: op::DATA_END | op::FOOTER,
                ..
            } => self.in_summary = true,
            Piece::Record {
                opcode: op::MESSAGE,
                ..
            } => self.loose = true,
            Piece::Chunk { .. } => self.chunked = true,
            _ => {}
        }
        Ok(Some(piece))
    }

    /// Goes on with the first record found behind `start`, for what was taken for a chunk there is none. Gives what lies
    /// between.
    pub fn retry(&mut self, source: &mut Source, start: u64) -> Result<Place, RecoverError> {
        // Definitions in what may be a chunk are not looked for.
        let next = self.search(source, start + 1, false)?;
        self.position = next.unwrap_or(source.size);
        Ok(Place::between(start, self.position))
    }

    fn damage(&self, source: &mut Source, start: u64) -> Result<Piece, RecoverError> {
        let next = self.search(source, start + 1, true)?;
        Ok(Piece::Damage {
            place: Place::between(start, next.unwrap_or(source.size)),
            cut: next.is_none(),
        })
    }

    /// What starts at `start`, if that can be said.
    fn recognize(&self, source: &mut Source, start: u64) -> Result<Option<Piece>, RecoverError> {
        let Some((opcode, length)) = prefix(source, start)? else {
            return Ok(None);
        };
        if let Some(piece) = recognize_chunk(source, start, opcode, length)? {
            return Ok(Some(piece));
        }
        if let Some(piece) = recognize_definition(source, start, opcode, length)? {
            return Ok(Some(piece));
        }
        let body = start + PREFIX;
        let Some(end) = body.checked_add(length).filter(|&end| end <= source.size) else {
            return Ok(None);
        };
        let followed = plausible(source, end)?;
        let place = Place {
            offset: body,
            length,
        };
        // No message lies behind a chunk: it is an index, whose operation code is damaged.
        let opcode = match opcode {
            op::MESSAGE if self.chunked && !self.loose && is_message_index(source, place)? => {
                op::MESSAGE_INDEX
            }
            opcode => opcode,
        };
        let sound = match opcode {
            op::FOOTER => length == 20,
            op::DATA_END => length == 4,
            op::SUMMARY_OFFSET => length == 17,
            op::MESSAGE => length >= 22 && followed,
            op::MESSAGE_INDEX => is_message_index(source, place)?,
            op::HEADER | op::SCHEMA | op::CHANNEL | op::METADATA => {
                (followed || start == MAGIC_LENGTH)
                    && length <= LIMIT as u64
                    && has_form(opcode, source.view(body, length as usize)?)
            }
            op::ATTACHMENT => length >= 32 && followed,
            op::CHUNK_INDEX | op::ATTACHMENT_INDEX | op::STATISTICS | op::METADATA_INDEX => {
                followed
            }
            0x80.. => followed,
            _ => false,
        };
        Ok(if sound {
            Some(Piece::Record { opcode, place })
        } else if followed {
            let place = Place::between(start, end);
            Some(Piece::Damage { place, cut: false })
        } else {
            None
        })
    }

    /// The first place from `from` on where a record starts beyond doubt.
    fn search(
        &self,
        source: &mut Source,
        from: u64,
        definitions: bool,
    ) -> Result<Option<u64>, RecoverError> {
        let mut at = from;
        while at + PREFIX <= source.size {
            let window = source.view(at, 64 << 10)?;
            let candidate = window.windows(PREFIX as usize).position(|bytes| {
                let targets = [
                    op::CHUNK,
                    op::MESSAGE_INDEX,
                    op::METADATA,
                    op::DATA_END,
                    op::MESSAGE,
                ];
                // No length takes more than five bytes.
                let is_target = targets.contains(&bytes[0])
                    || (definitions && [op::SCHEMA, op::CHANNEL].contains(&bytes[0]));
                is_target && bytes[6..] == [0; 3]
            });
            let Some(candidate) = candidate else {
                at += (window.len() as u64).saturating_sub(PREFIX - 1).max(1);
                continue;
            };
            at += candidate as u64;
            if self.is_certain(source, at)? {
                return Ok(Some(at));
            }
            at += 1;
        }
        // The end magic alone is no record, and nothing is left out where it stands.
        Ok(None)
    }

    fn is_certain(&self, source: &mut Source, start: u64) -> Result<bool, RecoverError> {
        let Some((opcode, length)) = prefix(source, start)? else {
            return Ok(false);
        };
        let end = start.saturating_add(PREFIX).saturating_add(length);
        let place = Place {
            offset: start + PREFIX,
            length,
        };
        Ok(match opcode {
            op::CHUNK => match recognize_chunk(source, start, opcode, length)? {
                Some(Piece::Chunk {
                    header,
                    cut,
                    followed,
                    ..
                }) => {
                    let in_order = header.times.0 <= header.times.1;
                    in_order && header.length + header.data_length == length && (followed || cut)
                }
                _ => false,
            },
            op::MESSAGE_INDEX => is_message_index(source, place)? && plausible(source, end)?,
            op::METADATA => marks_repeated(source, place)? && plausible(source, end)?,
            op::SCHEMA | op::CHANNEL => {
                is_definition(source, opcode, place)? && plausible(source, end)?
            }
            op::DATA_END => length == 4 && plausible(source, end)?,
            op::MESSAGE if self.loose => {
                // Two in a row.
                length >= 22
                    && plausible(source, end)?
                    && match prefix(source, end)? {
                        Some((_, next)) => plausible(source, end + PREFIX + next)?,
                        None => false,
                    }
            }
            _ => false,
        })
    }
}
