//! What a file tells of itself at its end.

use mcap::records::op;

use super::{
    DATA_END_LENGTH, FOOTER_LENGTH, MAGIC_LENGTH, RECORD_PREFIX,
    contents::{Contents, Span},
    source::Source,
};
use crate::{
    BagError, Damage, REPEATED,
    records::{Channel, ChunkIndex, Footer, Metadata, MetadataIndex, Schema, Statistics},
};

/// The footer of a file that is complete, and where it starts.
pub(crate) fn footer(source: &Source) -> Result<(Footer, u64), BagError> {
    let end_magic = source.end_magic();
    let found = source.bytes(end_magic, MAGIC_LENGTH)?;
    if found != mcap::MAGIC {
        return Err(source.truncated("the MCAP end magic", end_magic, found));
    }
    let start = end_magic.saturating_sub(FOOTER_LENGTH);
    let record = source.bytes(start, FOOTER_LENGTH)?;
    let Some((&[op::FOOTER, ..], body)) = record.split_first_chunk::<RECORD_PREFIX>() else {
        return Err(source.truncated("the footer record", start, record));
    };
    let footer = Footer::parse(body).map_err(|damage| source.damaged(start, damage))?;
    let summary = footer.summary_start;
    if summary != 0 && !(MAGIC_LENGTH + DATA_END_LENGTH..=start).contains(&summary) {
        let damage = Damage::OutOfRange {
            record: "footer",
            offset: summary,
            length: start.saturating_sub(summary),
            end: start,
        };
        return Err(source.damaged(start, damage));
    }
    Ok((footer, start))
}

/// Reads the summary; none if it does not tell of all messages, so that the file has to be scanned.
pub(crate) fn read(
    source: &Source,
    footer: &Footer,
    footer_start: u64,
) -> Result<Option<Contents>, BagError> {
    let start = footer.summary_start;
    if start == 0 {
        return Ok(None);
    }
    let mut contents = Contents::default();
    let mut statistics = None;
    let mut repeated = None;
    let mut records = source.records(start, footer_start + FOOTER_LENGTH - start)?;
    while let Some(prefix) = records.next()? {
        let damaged = |damage| source.damaged(prefix.offset, damage);
        match prefix.opcode {
            op::SCHEMA => {
                let schema = Schema::parse(records.body(prefix)?).map_err(damaged)?;
                contents.schemas.insert(schema.id, schema);
            }
            op::CHANNEL => {
                let channel = Channel::parse(records.body(prefix)?).map_err(damaged)?;
                contents.add_channel(channel).map_err(damaged)?;
            }
            op::CHUNK_INDEX => {
                let index = ChunkIndex::parse(records.body(prefix)?).map_err(damaged)?;
                check_range(source, "chunk index", index.offset, index.length, start)?;
                contents.add_chunk(
                    &index.compression,
                    index.packed_length,
                    index.unpacked_length,
                );
                contents.spans.push(Span::of_index(&index));
                // A chunk of definitions only has no times.
                if !index.channels.is_empty() || (index.start_time, index.end_time) != (0, 0) {
                    contents.extend_times(index.start_time, index.end_time);
                }
            }
            op::METADATA_INDEX => {
                let index = MetadataIndex::parse(records.body(prefix)?).map_err(damaged)?;
                check_range(source, "metadata index", index.offset, index.length, start)?;
                if index.name == REPEATED {
                    repeated = Some(index);
                }
            }
            op::STATISTICS => {
                let found = Statistics::parse(records.body(prefix)?).map_err(damaged)?;
                statistics = Some(found);
            }
            op::FOOTER => {
                // All up to the checksum itself.
                let _offsets = records.start::<16>(prefix)?;
                check_sum(source, footer, start, records.checksum())?;
                records.skip(prefix)?;
            }
            _ => records.skip(prefix)?,
        }
    }
    if let Some(index) = repeated {
        let metadata = record(source, &index)?;
        let damaged = |damage| source.damaged(index.offset, damage);
        contents.repeated = metadata.counts().map_err(damaged)?;
    }
    if !tells_all(&contents, statistics.as_ref()) {
        return Ok(None);
    }
    if let Some(statistics) = statistics {
        let told = (statistics.start_time, statistics.end_time);
        let indexed = contents.times;
        if statistics.message_count == 0 {
            contents.times = None;
        } else if told != (0, 0) {
            contents.times = Some(told);
        }
        // Messages beyond the times that are told would be passed over.
        if let (Some(expected), Some(found)) = (contents.times, indexed)
            && (found.0 < expected.0 || found.1 > expected.1)
        {
            let of = "chunk indexes";
            let damage = Damage::Times {
                of,
                expected,
                found,
            };
            return Err(source.damaged(start, damage));
        }
        contents.counts = Some(statistics.channel_message_counts);
    }
    Ok(Some(contents))
}

/// The last metadata record of a name.
pub(crate) fn metadata(
    source: &Source,
    footer: &Footer,
    footer_start: u64,
    name: &str,
) -> Result<Option<Metadata>, BagError> {
    let start = footer.summary_start;
    if start == 0 {
        return Ok(None);
    }
    let mut last = None;
    let mut records = source.records(start, footer_start - start)?;
    while let Some(prefix) = records.next()? {
        if prefix.opcode != op::METADATA_INDEX {
            records.skip(prefix)?;
            continue;
        }
        let damaged = |damage| source.damaged(prefix.offset, damage);
        let index = MetadataIndex::parse(records.body(prefix)?).map_err(damaged)?;
        if index.name == name {
            last = Some(index);
        }
    }
    last.map(|index| record(source, &index)).transpose()
}

fn check_sum(
    source: &Source,
    footer: &Footer,
    start: u64,
    calculated: u32,
) -> Result<(), BagError> {
    let saved = footer.summary_checksum;
    if saved == 0 || saved == calculated {
        return Ok(());
    }
    let damage = Damage::Checksum {
        of: "summary",
        saved,
        calculated,
    };
    Err(source.damaged(start, damage))
}

fn check_range(
    source: &Source,
    record: &'static str,
    offset: u64,
    length: u64,
    end: u64,
) -> Result<(), BagError> {
    if offset.checked_add(length).is_some_and(|last| last <= end) {
        return Ok(());
    }
    let damage = Damage::OutOfRange {
        record,
        offset,
        length,
        end,
    };
    Err(source.damaged(end, damage))
}

/// Whether all chunks are indexed, and all their channels and schemas known.
fn tells_all(contents: &Contents, statistics: Option<&Statistics>) -> bool {
    let known = |id| {
        let channel = contents.channels.get(id);
        channel.is_some_and(|channel| {
            channel.schema == 0 || contents.schemas.contains_key(&channel.schema)
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
fn record(source: &Source, index: &MetadataIndex) -> Result<Metadata, BagError> {
    let mut records = source.records(index.offset, index.length)?;
    let damaged = |damage| source.damaged(index.offset, damage);
    match records.next()? {
        Some(prefix) if prefix.opcode == op::METADATA => {
            let metadata = Metadata::parse(records.body(prefix)?).map_err(damaged)?;
            if metadata.name == index.name {
                return Ok(metadata);
            }
        }
        _ => {}
    }
    let expected = index.name.clone();
    Err(damaged(Damage::NoMetadata { expected }))
}
