//! Checksums of whole sections, and the summary where its checksum is right.

use mcap::{MAGIC, records::op};

use super::{LIMIT, RecoverError, chunk::record, scan::Place, source::Source};

/// The footer record and the end magic.
const END: usize = 9 + FOOTER + MAGIC.len();

/// Two offsets and a checksum.
const FOOTER: usize = 8 + 8 + 4;

/// The records of the summary, of a file that has its end and a summary whose checksum is right.
pub(super) fn read(source: &Source) -> Result<Option<Vec<u8>>, RecoverError> {
    let Some(footer) = source.size.checked_sub(END as u64) else {
        return Ok(None);
    };
    let (end, known) = source.peek::<END>(footer)?;
    if known < END || end[0] != op::FOOTER || !end.ends_with(MAGIC) {
        return Ok(None);
    }
    let u64_at = |at: usize| {
        end[at..]
            .first_chunk()
            .copied()
            .map_or(0, u64::from_le_bytes)
    };
    let saved = end[25..]
        .first_chunk()
        .copied()
        .map_or(0, u32::from_le_bytes);
    let start = u64_at(9);
    if saved == 0 || start == 0 || start > footer || footer - start > LIMIT as u64 {
        return Ok(None);
    }
    let mut summary = source.bytes(start, (footer - start) as usize)?;
    let length = summary.len();
    // The checksum covers the footer up to itself.
    summary.extend_from_slice(&end[..25]);
    if crc32fast::hash(&summary) != saved {
        return Ok(None);
    }
    summary.truncate(length);
    Ok(Some(summary))
}

/// The records of a summary, each with its operation code.
pub(super) fn records(summary: &[u8]) -> impl Iterator<Item = (u8, &[u8])> {
    let mut left = summary;
    std::iter::from_fn(move || {
        let (opcode, body, rest) = record(left)?;
        left = rest;
        Some((opcode, body))
    })
}

/// Whether everything before the record that ends the data is as that record's checksum says.
pub(super) fn data_are_sound(
    source: &mut Source,
    data_end: Option<Place>,
) -> Result<bool, RecoverError> {
    let Some(place) = data_end else {
        return Ok(false);
    };
    let (saved, known) = source.peek::<4>(place.offset)?;
    let saved = u32::from_le_bytes(saved);
    if known < 4 || saved == 0 {
        return Ok(false);
    }
    let mut hasher = crc32fast::Hasher::new();
    let end = place.offset - 9;
    let mut at = 0;
    while at < end {
        let bytes = source.view(at, (end - at).min(64 << 10) as usize)?;
        if bytes.is_empty() {
            return Ok(false);
        }
        hasher.update(bytes);
        at += bytes.len() as u64;
    }
    Ok(hasher.finalize() == saved)
}
