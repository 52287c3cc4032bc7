//! What schemas and channels look like in a file.

use mcap::records::op;

use super::{
    LIMIT, RecoverError,
    plausibility::is_graphic,
    scan::{PREFIX, Piece, Place},
    shape::plausible,
    source::Source,
};

/// Longest name of a topic or type, and of an encoding, by which definitions are recognized.
const NAME: usize = 512;
const ENCODING: usize = 32;

/// A schema or a channel, even if its operation code or its length is wrong: its fields tell where it ends.
pub(super) fn recognize_definition(
    source: &Source,
    start: u64,
    opcode: u8,
    length: u64,
) -> Result<Option<Piece>, RecoverError> {
    let body = start + PREFIX;
    for kind in [op::SCHEMA, op::CHANNEL] {
        let Some(end) = end(source, kind, body)? else {
            continue;
        };
        let is_long = body.checked_add(length) == Some(end);
        let is_kind = opcode == kind;
        if (is_long && is_kind) || ((is_long || is_kind) && plausible(source, end)?) {
            let place = Place::between(body, end);
            return Ok(Some(Piece::Record {
                opcode: kind,
                place,
            }));
        }
    }
    Ok(None)
}

/// Whether the fields of a definition fill the place exactly.
pub(super) fn is_definition(
    source: &Source,
    opcode: u8,
    place: Place,
) -> Result<bool, RecoverError> {
    let end = end(source, opcode, place.offset)?;
    Ok(end.is_some_and(|end| place.offset.checked_add(place.length) == Some(end)))
}

/// Where a definition ends by its fields, if there may be one.
fn end(source: &Source, opcode: u8, body: u64) -> Result<Option<u64>, RecoverError> {
    let numbers = if opcode == op::SCHEMA { 2 } else { 4 };
    let Some((name, at)) = field(source, body + numbers, NAME)? else {
        return Ok(None);
    };
    if !is_graphic(&name) {
        return Ok(None);
    }
    let Some((encoding, at)) = field(source, at, ENCODING)? else {
        return Ok(None);
    };
    // Types of which only the name is known have none.
    let may_lack = opcode == op::SCHEMA && encoding.is_empty();
    if !may_lack && !is_graphic(&encoding) {
        return Ok(None);
    }
    let Some(length) = length(source, at, LIMIT)? else {
        return Ok(None);
    };
    let end = at + 4 + length as u64;
    Ok((end <= source.size).then_some(end))
}

/// A text of at most so many bytes, and where it ends.
fn field(source: &Source, at: u64, most: usize) -> Result<Option<(String, u64)>, RecoverError> {
    let Some(length) = length(source, at, most)? else {
        return Ok(None);
    };
    let text = String::from_utf8(source.bytes(at + 4, length)?).ok();
    let text = text.filter(|text| text.len() == length);
    Ok(text.map(|text| (text, at + 4 + length as u64)))
}

fn length(source: &Source, at: u64, most: usize) -> Result<Option<usize>, RecoverError> {
    let (bytes, known) = source.peek::<4>(at)?;
    let length = u32::from_le_bytes(bytes) as usize;
    Ok((known == bytes.len() && length <= most).then_some(length))
}
