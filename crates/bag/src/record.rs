//! Records, read by the crate `mcap` once their lengths are known to end within them.

use std::{collections::BTreeMap, ops::Range};

use mcap::records::{MessageHeader, Metadata, Record, op};

use crate::Damage;

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
                let rest = text(opcode, left)?.len() % length;
                take(opcode, &mut &body[..rest], rest.div_ceil(*length) * length)?;
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
    let Some((field, rest)) = left.split_at_checked(needed) else {
        let left = left.len();
        return Err(Damage::Short {
            opcode,
            needed,
            left,
        });
    };
    *left = rest;
    Ok(field)
}

/// Parses a message: header and data.
pub(crate) fn message(body: &[u8]) -> Result<(MessageHeader, &[u8]), Damage> {
    match mcap::parse_record(op::MESSAGE, body)? {
        Record::Message { header, .. } => Ok((header, &body[MESSAGE_HEADER..])),
        other => Err(Damage::short(other.opcode(), MESSAGE_HEADER, body)),
    }
}

/// Operation code and length of the record that begins with these bytes.
pub(crate) fn prefix(bytes: &[u8]) -> Option<(u8, u64)> {
    let [opcode, length @ ..] = bytes.first_chunk::<PREFIX>()?;
    Some((*opcode, u64::from_le_bytes(*length)))
}

/// The entries of a metadata record as counts.
pub(crate) fn counts(record: &Metadata) -> Result<BTreeMap<String, u64>, Damage> {
    let counts = record.metadata.iter().map(|(key, value)| {
        let count = value.parse::<u32>().map_err(|_| Damage::Disagrees {
            record: crate::REPEATED,
            field: "count",
            told: format!("{value:?} of {key}"),
            found: "no count".to_owned(),
        });
        Ok((key.clone(), count?.into()))
    });
    counts.collect()
}

/// Operation codes and bodies of records in memory; ends after the first error.
pub(crate) struct Records<'a> {
    bytes: &'a [u8],
    /// Start of the next record.
    pub offset: usize,
}

impl<'a> Records<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, offset: 0 }
    }

    fn split(&self) -> Result<(u8, Range<usize>), Damage> {
        let left = &self.bytes[self.offset..];
        let short = |needed| Damage::short(op::CHUNK, needed, left);
        let (opcode, length) = prefix(left).ok_or_else(|| short(PREFIX))?;
        let start = self.offset + PREFIX;
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        match start.checked_add(length) {
            Some(end) if end <= self.bytes.len() => Ok((opcode, start..end)),
            _ => Err(short(length)),
        }
    }
}

impl Iterator for Records<'_> {
    type Item = Result<(u8, Range<usize>), Damage>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.offset >= self.bytes.len() {
            return None;
        }
        let record = self.split();
        let end = record.as_ref().map(|(_, body)| body.end);
        self.offset = end.unwrap_or(self.bytes.len());
        Some(record)
    }
}
