//! What records look like.

use mcap::{MAGIC, records::op};

use super::{
    LIMIT, RecoverError,
    chunk::{self, ChunkHeader},
    scan::{MAGIC_LENGTH, PREFIX, Piece, Place},
    source::Source,
};
use crate::REPEATED;

/// Longest record that marks repeated messages and is searched for.
const LONGEST_MARKS: u64 = 16 << 10;

/// A chunk, whatever its operation code says, and even if one of the two lengths that it has is wrong.
pub(super) fn recognize_chunk(
    source: &Source,
    start: u64,
    opcode: u8,
    length: u64,
) -> Result<Option<Piece>, RecoverError> {
    let body = start + PREFIX;
    let (bytes, known) = source.peek::<{ chunk::HEADER }>(body)?;
    let Some(header) = ChunkHeader::parse(&bytes[..known]) else {
        return Ok(None);
    };
    let by_header = header.length.checked_add(header.data_length);
    let consistent = by_header == Some(length);
    if !consistent && opcode != op::CHUNK {
        return Ok(None);
    }
    let piece = |length: u64, cut, followed| Piece::Chunk {
        header,
        data: Place {
            offset: body + header.length,
            length: length - header.length,
        },
        start,
        cut,
        followed,
    };
    let lengths = [Some(length), by_header.filter(|_| !consistent)];
    for length in lengths.into_iter().flatten() {
        let Some(end) = body.checked_add(length) else {
            continue;
        };
        if length < header.length || end > source.size {
            continue;
        }
        let followed = plausible(source, end)?;
        if followed || consistent {
            return Ok(Some(piece(length, false, followed)));
        }
    }
    let reaches_beyond = body
        .checked_add(length)
        .is_some_and(|end| end > source.size);
    // A chunk of this size is not written.
    let cut = consistent && opcode == op::CHUNK && reaches_beyond && length < 1 << 40;
    Ok(cut.then(|| piece(source.size - body, true, false)))
}

pub(super) fn prefix(source: &Source, offset: u64) -> Result<Option<(u8, u64)>, RecoverError> {
    let (bytes, known) = source.peek::<9>(offset)?;
    let [opcode, length @ ..] = bytes;
    Ok((known == bytes.len()).then(|| (opcode, u64::from_le_bytes(length))))
}

pub(super) fn is_magic(source: &Source, offset: u64) -> Result<bool, RecoverError> {
    let (found, length) = source.peek::<{ MAGIC.len() }>(offset)?;
    Ok(found[..length] == *MAGIC)
}

/// Whether a record may start here, or the file end.
pub(super) fn plausible(source: &Source, offset: u64) -> Result<bool, RecoverError> {
    let left = source.size.saturating_sub(offset);
    if left <= MAGIC_LENGTH {
        let (found, length) = source.peek::<{ MAGIC.len() }>(offset)?;
        return Ok(match found[..length] {
            [] => true,
            _ if MAGIC.starts_with(&found[..length]) => true,
            [opcode, ..] => (op::HEADER..=op::DATA_END).contains(&opcode),
        });
    }
    let Some((opcode, length)) = prefix(source, offset)? else {
        return Ok(false);
    };
    let range = match opcode {
        op::FOOTER => 20..=20,
        op::DATA_END => 4..=4,
        op::SUMMARY_OFFSET => 17..=17,
        op::HEADER | op::METADATA | op::STATISTICS => 8..=LIMIT as u64,
        op::SCHEMA | op::CHANNEL | op::METADATA_INDEX => 14..=LIMIT as u64,
        op::MESSAGE => 22..=LIMIT as u64,
        op::CHUNK => 40..=1 << 40,
        op::MESSAGE_INDEX => 6..=1 << 40,
        op::CHUNK_INDEX | op::ATTACHMENT_INDEX | op::ATTACHMENT => 32..=1 << 40,
        _ => return Ok(false),
    };
    Ok(range.contains(&length))
}

/// A channel's number, the length of the list, and sixteen bytes a message.
pub(super) fn is_message_index(source: &Source, place: Place) -> Result<bool, RecoverError> {
    let (bytes, known) = source.peek::<6>(place.offset)?;
    let [_, _, length @ ..] = bytes;
    let length = u64::from(u32::from_le_bytes(length));
    Ok(known == bytes.len() && place.length == 6 + length && length.is_multiple_of(16))
}

/// The record of metadata that marks repeated messages.
pub(super) fn marks_repeated(source: &Source, place: Place) -> Result<bool, RecoverError> {
    const NAME: usize = REPEATED.len();
    let (bytes, known) = source.peek::<{ 4 + NAME }>(place.offset)?;
    let [_, _, _, _, name @ ..] = bytes;
    if known < bytes.len() || name != *REPEATED.as_bytes() || place.length > LONGEST_MARKS {
        return Ok(false);
    }
    let body = source.bytes(place.offset, place.length as usize)?;
    Ok(has_form(op::METADATA, &body))
}

/// Whether a record's fields fill it exactly.
pub(super) fn has_form(opcode: u8, body: &[u8]) -> bool {
    let numbers = match opcode {
        op::SCHEMA => 2,
        op::CHANNEL => 4,
        _ => 0,
    };
    let fields = match opcode {
        op::SCHEMA | op::CHANNEL => 3,
        _ => 2,
    };
    let mut left = body.get(numbers..);
    for _ in 0..fields {
        left = left.and_then(|left| {
            let (length, rest) = left.split_first_chunk()?;
            rest.get(u32::from_le_bytes(*length) as usize..)
        });
    }
    left.is_some_and(<[u8]>::is_empty)
}
