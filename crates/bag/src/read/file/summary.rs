//! What a file tells of itself at its end.

use std::ops::ControlFlow;

use mcap::{
    records::{Metadata, MetadataIndex, Record, Statistics, op},
    sans_io::linear_reader::LinearReaderOptions,
};

use super::{
    MAGIC_LENGTH, MAX_RECORD_LENGTH,
    contents::{Contents, Span},
    source::Source,
};
use crate::{
    BagError, Damage, REPEATED,
    damage::agree,
    record::{self, PREFIX, parse},
    times::around,
};

/// The data end record lies right before the summary.
const DATA_END_LENGTH: u64 = PREFIX as u64 + 4;

/// The footer record holds two offsets and a checksum and lies right before the end magic.
const FOOTER_LENGTH: u64 = PREFIX as u64 + 8 + 8 + 4;

/// Returns true if the file ends with a footer and the MCAP magic.
pub(crate) fn has_end(source: &Source) -> Result<bool, BagError> {
    let length = FOOTER_LENGTH + MAGIC_LENGTH;
    let end = source.bytes(source.size.saturating_sub(length), length)?;
    Ok(end.first() == Some(&op::FOOTER) && end.ends_with(mcap::MAGIC))
}

/// The start of the summary, if there is one, of a file that is complete.
fn start(source: &Source) -> Result<Option<u64>, BagError> {
    let end_magic = source.size.saturating_sub(MAGIC_LENGTH);
    let found = source.bytes(end_magic, MAGIC_LENGTH)?;
    if found != mcap::MAGIC {
        return Err(source.truncated("the MCAP end magic", end_magic, found));
    }
    let end = end_magic.saturating_sub(FOOTER_LENGTH);
    let record = source.bytes(end, FOOTER_LENGTH)?;
    let Some((&[op::FOOTER, ..], body)) = record.split_first_chunk::<PREFIX>() else {
        return Err(source.truncated("the footer record", end, record));
    };
    match parse(op::FOOTER, body).map_err(|damage| source.damaged(end, damage))? {
        Record::Footer(footer) if footer.summary_start != 0 => {
            let start = footer.summary_start;
            let least = MAGIC_LENGTH + DATA_END_LENGTH;
            check_range(source, "footer", start.saturating_sub(least), least, end)?;
            Ok(Some(start.max(least)))
        }
        _ => Ok(None),
    }
}

/// Gives `take` the records of the summary, whose checksum is compared.
fn walk(
    source: &Source,
    start: u64,
    mut take: impl FnMut(Record<'_>, usize) -> Result<(), Damage>,
) -> Result<(), BagError> {
    let options = LinearReaderOptions::default()
        .with_validate_summary_section_crc(true)
        .with_skip_end_magic(true);
    source.walk(
        Some(start - DATA_END_LENGTH),
        options,
        |offset, opcode, body| {
            let taken = parse(opcode, body).and_then(|record| take(record, body.len()));
            let taken = taken.map_err(|damage| source.damaged(offset, damage));
            taken.map(ControlFlow::Continue)
        },
    )
}

/// Reads the summary; `None` if it does not tell of all messages, so that the file has to be scanned.
pub(crate) fn read(source: &Source) -> Result<Option<Contents>, BagError> {
    let Some(start) = start(source)? else {
        return Ok(None);
    };
    let mut contents = Contents::default();
    let mut statistics = None;
    let mut repeated = None;
    let mut indexes = Vec::new();
    walk(source, start, |record, length| {
        match record {
            Record::Schema { .. } | Record::Channel(_) => contents.define(record, length)?,
            Record::ChunkIndex(index) => {
                contents.add_chunk(
                    &index.compression,
                    index.compressed_size,
                    index.uncompressed_size,
                );
                contents.spans.push(Span::of_index(&index));
            }
            Record::MetadataIndex(index) => indexes.push(index),
            Record::Statistics(found) => statistics = Some(found),
            _ => {}
        }
        Ok(())
    })?;
    for span in &contents.spans {
        check_range(source, "chunk index", span.offset, span.length, start)?;
    }
    for index in indexes {
        check_range(source, "metadata index", index.offset, index.length, start)?;
        repeated = Some(index)
            .filter(|index| index.name == REPEATED)
            .or(repeated);
    }
    if let Some(index) = repeated {
        let counts = record::counts(&metadata_at(source, &index)?);
        contents.repeated = counts.map_err(|damage| source.damaged(index.offset, damage))?;
    }
    if !tells_all(&contents, statistics.as_ref()) {
        return Ok(None);
    }
    // A chunk of definitions only has no times.
    let timed = contents
        .spans
        .iter()
        .filter(|span| span.channels.is_some() || (span.start_time, span.end_time) != (0, 0));
    contents.times = around(timed.map(|span| (span.start_time, span.end_time)));
    if let Some(statistics) = statistics {
        let told = (statistics.message_start_time, statistics.message_end_time);
        let indexed = contents.times;
        if statistics.message_count == 0 {
            contents.times = None;
        } else if told != (0, 0) {
            contents.times = Some(told);
        }
        // Messages beyond the times that are told would be passed over.
        let wider = around(contents.times.into_iter().chain(indexed));
        if indexed.is_some() && contents.times.is_some() {
            agree("statistics", "log times", contents.times, wider)
                .map_err(|damage| source.damaged(start, damage))?;
        }
        contents.counts = Some(statistics.channel_message_counts);
    }
    Ok(Some(contents))
}

fn check_range(
    source: &Source,
    record: &'static str,
    offset: u64,
    length: u64,
    end: u64,
) -> Result<(), BagError> {
    let last = offset.saturating_add(length);
    agree(record, "end of what it points to", last, last.min(end))
        .map_err(|damage| source.damaged(end, damage))
}

/// Returns true if all chunks are indexed, and all their channels and schemas known.
fn tells_all(contents: &Contents, statistics: Option<&Statistics>) -> bool {
    let known = |id: &u16| {
        let channel = contents.channels.get(id);
        channel.is_some_and(|channel| {
            channel.schema_id == 0 || contents.schemas.contains_key(&channel.schema_id)
        })
    };
    let in_chunks = contents
        .spans
        .iter()
        .filter_map(|span| span.channels.as_ref());
    let counted = statistics.map(|statistics| &statistics.channel_message_counts);
    let all_indexed = match statistics {
        Some(found) => {
            found.chunk_count as usize == contents.spans.len()
                && (found.chunk_count > 0 || found.message_count == 0)
        }
        None => !contents.spans.is_empty(),
    };
    all_indexed
        && !contents.channels.is_empty()
        && contents.channels.keys().all(known)
        && in_chunks.flatten().all(known)
        && counted
            .into_iter()
            .flat_map(|counts| counts.keys())
            .all(known)
}

/// Reads the metadata record where its index says.
fn metadata_at(source: &Source, index: &MetadataIndex) -> Result<Metadata, BagError> {
    let damaged = |damage| source.damaged(index.offset, damage);
    let (opcode, body) = source.record(index.offset, MAX_RECORD_LENGTH)?;
    let found = match parse(opcode, &body).map_err(damaged)? {
        Record::Metadata(metadata) if metadata.name == index.name => return Ok(metadata),
        Record::Metadata(metadata) => metadata.name,
        _ => format!("record {opcode:#04x}"),
    };
    Err(damaged(Damage::Disagrees {
        record: "metadata index",
        field: "name",
        told: index.name.clone(),
        found,
    }))
}
