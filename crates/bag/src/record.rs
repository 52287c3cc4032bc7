//! Records, read by the crate `mcap` once their lengths are known to end within them.

use std::{collections::BTreeMap, iter, ops::Range};

use mcap::records::{MessageHeader, Metadata, Record, op};

use crate::error::Damage;

/// Bytes before the body of a record: operation code and length.
pub(crate) const PREFIX: usize = 1 + 8;

/// Bytes of a message before its data.
pub(crate) const MESSAGE_HEADER: usize = 2 + 4 + 8 + 8;

/// Bytes of a chunk before the name of its compression.
pub(crate) const CHUNK_TIMES: usize = 8 + 8 + 8 + 4;

/// A field of a record. All but the fixed ones begin with their length in four bytes.
enum Field {
    /// Numbers of so many bytes.
    Fixed(usize),
    Text,
    /// Pairs of texts.
    Texts,
    /// Numbers of so many bytes, any number of times.
    Entries(usize),
}

/// Parses the body of a record.
///
/// The crate's parser reserves as much memory as a length asks for, and reads a list beyond its end into the next field.
pub(crate) fn parse(opcode: u8, body: &[u8]) -> Result<Record<'_>, Damage> {
    use Field::{Entries, Fixed, Text, Texts};
    let fields: &[Field] = match opcode {
        op::HEADER => &[Text, Text],
        op::SCHEMA => &[Fixed(2), Text, Text, Text],
        op::CHANNEL => &[Fixed(4), Text, Text, Texts],
        op::CHUNK => &[Fixed(CHUNK_TIMES), Text, Fixed(8)],
        op::MESSAGE_INDEX => &[Fixed(2), Entries(16)],
        op::CHUNK_INDEX => &[Fixed(32), Entries(10), Fixed(8), Text, Fixed(16)],
        // Length of the data and, behind those, a checksum.
        op::ATTACHMENT => &[Fixed(16), Text, Text, Fixed(8 + 4)],
        op::ATTACHMENT_INDEX => &[Fixed(40), Text, Text],
        op::STATISTICS => &[Fixed(42), Entries(10)],
        op::METADATA => &[Text, Texts],
        op::METADATA_INDEX => &[Fixed(16), Text],
        _ => &[],
    };
    let mut left = body;
    for field in fields {
        let left = &mut left;
        match field {
            Fixed(length) => drop(take(opcode, left, *length)?),
            Text => drop(text(opcode, left)?),
            Texts => {
                let mut pairs = text(opcode, left)?;
                while !pairs.is_empty() {
                    text(opcode, &mut pairs)?;
                    text(opcode, &mut pairs)?;
                }
            }
            Entries(length) => {
                let entries = text(opcode, left)?;
                if entries.len() % length != 0 {
                    return Err(short(opcode, *length, entries.len() % length));
                }
            }
        }
    }
    Ok(mcap::parse_record(opcode, body)?)
}

fn text<'a>(opcode: u8, left: &mut &'a [u8]) -> Result<&'a [u8], Damage> {
    let length = take(opcode, left, size_of::<u32>())?;
    let length = length.first_chunk().map_or(0, |l| u32::from_le_bytes(*l));
    take(opcode, left, length as usize)
}

fn take<'a>(opcode: u8, left: &mut &'a [u8], needed: usize) -> Result<&'a [u8], Damage> {
    let split = left.split_at_checked(needed);
    let (field, rest) = split.ok_or_else(|| short(opcode, needed, left.len()))?;
    *left = rest;
    Ok(field)
}

fn short(opcode: u8, needed: usize, left: usize) -> Damage {
    let text = format!("record {opcode:#04x}: a field needs {needed} bytes, {left} are left");
    Damage(text)
}

/// Parses a message: header and data.
pub(crate) fn message(body: &[u8]) -> Result<(MessageHeader, &[u8]), Damage> {
    match mcap::parse_record(op::MESSAGE, body)? {
        Record::Message { header, .. } => Ok((header, &body[MESSAGE_HEADER..])),
        other => Err(short(other.opcode(), MESSAGE_HEADER, body.len())),
    }
}

/// Operation code and length of the record that begins with these bytes.
pub(crate) fn prefix(bytes: &[u8]) -> Option<(u8, u64)> {
    let [opcode, length @ ..] = bytes.first_chunk::<PREFIX>()?;
    Some((*opcode, u64::from_le_bytes(*length)))
}

/// How many messages of each topic are repeated, by a metadata record.
pub(crate) fn repeated(record: Metadata) -> Result<BTreeMap<String, u64>, Damage> {
    let counts = record.metadata.into_iter().map(|(topic, count)| {
        let parsed = count.parse::<u32>().map_err(|_| {
            let name = crate::REPEATED;
            Damage(format!(
                "{name} record: {count:?} of {topic}, expected a count"
            ))
        });
        Ok((topic, parsed?.into()))
    });
    counts.collect()
}

/// Operation codes of records in memory, and where their bodies are; ends after the first error.
pub(crate) fn records(
    bytes: &[u8],
) -> impl Iterator<Item = Result<(u8, Range<usize>), Damage>> + '_ {
    let mut offset = 0;
    iter::from_fn(move || {
        let left = bytes.get(offset..).filter(|left| !left.is_empty())?;
        let record = split(left).map(|(opcode, end)| (opcode, offset + PREFIX..offset + end));
        offset = record.as_ref().map_or(bytes.len(), |(_, body)| body.end);
        Some(record)
    })
}

/// Operation code and end of the first record.
fn split(bytes: &[u8]) -> Result<(u8, usize), Damage> {
    let Some((opcode, length)) = prefix(bytes) else {
        return Err(short(op::CHUNK, PREFIX, bytes.len()));
    };
    let end = usize::try_from(length)
        .unwrap_or(usize::MAX)
        .saturating_add(PREFIX);
    match end <= bytes.len() {
        true => Ok((opcode, end)),
        false => Err(short(op::CHUNK, end, bytes.len())),
    }
}
