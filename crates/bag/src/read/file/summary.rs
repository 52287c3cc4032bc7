//! What a file tells of itself at its end.

use std::{collections::BTreeMap, ops::ControlFlow};

use mcap::{
    records::{Footer, MetadataIndex, Record, Statistics, op},
    sans_io::linear_reader::LinearReaderOptions,
};

use super::{
    MAGIC_LENGTH, MAX_RECORD_LENGTH,
    contents::{Contents, Span},
    source::Source,
};
use crate::{
    BagError, Damage, REPEATED,
    error::agree,
    record::{self, PREFIX, parse},
    times::{Times, around, sum},
};

/// The data end record lies right before the summary.
const DATA_END_LENGTH: u64 = PREFIX as u64 + 4;

/// The footer record holds two offsets and a checksum; the magic follows it.
const END_LENGTH: u64 = PREFIX as u64 + 8 + 8 + 4 + MAGIC_LENGTH;

/// The footer of a file that is complete.
pub(crate) fn footer(source: &Source) -> Result<Footer, BagError> {
    let at = source.size.saturating_sub(END_LENGTH);
    let end = source.bytes(at, END_LENGTH)?;
    let record = end.strip_suffix(mcap::MAGIC);
    if let Some((&[op::FOOTER, ..], body)) = record.and_then(<[u8]>::split_first_chunk::<PREFIX>)
        && let Ok(Record::Footer(footer)) = parse(op::FOOTER, body)
    {
        return Ok(footer);
    }
    Err(source.truncated("a footer and the MCAP end magic", at, &end))
}

/// Reads the summary; `None` if it does not tell of all messages, so that the file has to be scanned.
pub(crate) fn read(source: &Source) -> Result<Option<Contents>, BagError> {
    let Some((mut contents, statistics)) = summary(source)? else {
        return Ok(None);
    };
    let Some(statistics) = statistics.filter(|statistics| tells_all(&contents, statistics)) else {
        return Ok(None);
    };
    contents.times = times(&contents.spans, &statistics)
        .map_err(|damage| source.damaged(source.size - END_LENGTH, damage))?;
    contents.counts = statistics.channel_message_counts;
    contents.counts.retain(|_, count| *count > 0);
    Ok(Some(contents))
}

/// What the summary tells, whether or not it is all: definitions, and the number of messages.
pub(crate) fn told(source: &Source) -> Result<Option<(Contents, Option<u64>)>, BagError> {
    let summary = summary(source)?;
    Ok(summary.map(|(contents, statistics)| {
        let count = statistics.map(|statistics| {
            let by_channel = sum(statistics.channel_message_counts.values().copied());
            by_channel.max(statistics.message_count)
        });
        (contents, count)
    }))
}

/// Reads the summary section, if there is one.
fn summary(source: &Source) -> Result<Option<(Contents, Option<Statistics>)>, BagError> {
    let footer = footer(source)?;
    let start = footer.summary_start;
    if start == 0 {
        return Ok(None);
    }
    let in_file = |record: &str, offset: u64, length: u64, end: u64| {
        let last = offset.saturating_add(length);
        agree(
            &format!("{record} record: end of what it points to"),
            last,
            last.min(end),
        )
        .map_err(|damage| source.damaged(end, damage))
    };
    let least = MAGIC_LENGTH + DATA_END_LENGTH;
    in_file(
        "footer",
        start.saturating_sub(least),
        least,
        source.size - END_LENGTH,
    )?;
    let start = start.max(least);
    let mut contents = Contents::default();
    let mut statistics = None;
    let mut indexes = Vec::new();
    let mut take = |record: Record<'_>, length| {
        match record {
            Record::Schema { .. } | Record::Channel(_) => contents.define(record, length)?,
            Record::ChunkIndex(index) => {
                let (packed, unpacked) = (index.compressed_size, index.uncompressed_size);
                contents.add_chunk(&index.compression, packed, unpacked);
                contents.spans.push(Span::of_index(&index));
            }
            Record::MetadataIndex(index) => indexes.push(index),
            Record::Statistics(found) => statistics = Some(found),
            _ => {}
        }
        Ok(())
    };
    let options = LinearReaderOptions::default()
        .with_validate_summary_section_crc(true)
        .with_skip_end_magic(true);
    let first = start - DATA_END_LENGTH;
    source.walk(Some(first), options, |_, opcode, body| {
        let taken = parse(opcode, body).and_then(|record| take(record, body.len()));
        taken.map(ControlFlow::Continue)
    })?;
    for span in &contents.spans {
        in_file("chunk index", span.offset, span.length, start)?;
    }
    apart(&contents.spans).map_err(|damage| source.damaged(start, damage))?;
    for index in &indexes {
        in_file("metadata index", index.offset, index.length, start)?;
    }
    if let Some(index) = indexes.iter().rfind(|index| index.name == REPEATED) {
        contents.repeated = repeated(source, index)?;
    }
    Ok(Some((contents, statistics)))
}

/// Checks that no two chunks of the index overlap.
fn apart(spans: &[Span]) -> Result<(), Damage> {
    let mut places: Vec<_> = spans
        .iter()
        .map(|span| (span.offset, span.length))
        .collect();
    places.sort_unstable();
    for pair in places.windows(2) {
        let end = pair[0].0.saturating_add(pair[0].1);
        agree(
            "chunk index record: start of a chunk behind another",
            pair[1].0,
            pair[1].0.max(end),
        )?;
    }
    Ok(())
}

/// Returns true if all chunks are indexed, all messages counted, and their channels and schemas known.
fn tells_all(contents: &Contents, statistics: &Statistics) -> bool {
    let known = |id: &u16| {
        let channel = contents.channels.get(id);
        channel.is_some_and(|channel| {
            channel.schema_id == 0 || contents.schemas.contains_key(&channel.schema_id)
        })
    };
    let counts = &statistics.channel_message_counts;
    statistics.chunk_count as usize == contents.spans.len()
        && (statistics.chunk_count > 0 || statistics.message_count == 0)
        && (!counts.is_empty() || statistics.message_count == 0)
        && !contents.channels.is_empty()
        && contents.channels.keys().chain(counts.keys()).all(known)
}

/// The times of all messages: those of the statistics, or of the chunks if it tells none.
fn times(spans: &[Span], statistics: &Statistics) -> Result<Times, Damage> {
    if statistics.message_count == 0 {
        return Ok(None);
    }
    // A chunk of definitions only has no times.
    let timed = spans
        .iter()
        .filter(|span| span.channels.is_some() || span.times != (0, 0));
    let indexed = around(timed.map(|span| span.times));
    let told = (statistics.message_start_time, statistics.message_end_time);
    if told == (0, 0) {
        return Ok(indexed);
    }
    // Messages beyond the times that are told would be passed over.
    let found = around(indexed.into_iter().chain([told]));
    agree("statistics record: log times", Some(told), found)?;
    Ok(Some(told))
}

/// Reads how many messages are repeated, from where the index says.
fn repeated(source: &Source, index: &MetadataIndex) -> Result<BTreeMap<String, u64>, BagError> {
    let (opcode, body) = source.record(index.offset, MAX_RECORD_LENGTH)?;
    let counts = parse(opcode, &body).and_then(|record| match record {
        Record::Metadata(metadata) if metadata.name == REPEATED => record::repeated(metadata),
        _ => Err(Damage(format!(
            "metadata index record: no {REPEATED} where it points to"
        ))),
    });
    counts.map_err(|damage| source.damaged(index.offset, damage))
}
