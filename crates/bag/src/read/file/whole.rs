//! A file read from its start to its end, as a reader of a stream does, and its indexes held against what they index.

use std::{
    collections::{BTreeMap, btree_map::Entry},
    fmt::Debug,
    io::Read,
};

use mcap::{
    records::{self, Channel, ChunkIndex, MessageIndexEntry, Record, Statistics, op},
    sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

use super::{MAGIC_LENGTH, MAX_CHUNK_LENGTH, RECORD_PREFIX, Source, chunk, walk};
use crate::{
    BagError, Damage,
    records::{ChunkHeader, MessageHeader},
};

/// The first thing that is wrong with a file: in a checksum, a record, or in what one record tells of others.
pub(crate) fn fault(source: &Source) -> Option<BagError> {
    read(source).err()
}

fn read(source: &Source) -> Result<(), BagError> {
    let options = LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true)
        .with_record_length_limit(MAX_CHUNK_LENGTH);
    let mut bytes = source.section(0, source.size)?;
    let mut reader = LinearReader::new_with_options(options);
    let mut file = Whole {
        offset: MAGIC_LENGTH,
        ..Whole::default()
    };
    while let Some(event) = reader.next_event() {
        let event = event.map_err(|error| source.damaged(file.offset, Damage::stream(error)))?;
        match event {
            LinearReadEvent::ReadRequest(needed) => {
                let read = bytes.read(reader.insert(needed));
                reader.notify_read(read.map_err(|error| source.io_error(error))?);
            }
            LinearReadEvent::Record { opcode, data } => {
                file.take(opcode, data)
                    .map_err(|damage| source.damaged(file.offset, damage))?;
                file.offset += (RECORD_PREFIX + data.len()) as u64;
            }
        }
    }
    Ok(())
}

/// What has been read so far.
#[derive(Default)]
struct Whole {
    /// Of the present record.
    offset: u64,
    /// Bodies of the schemas.
    schemas: BTreeMap<u16, Vec<u8>>,
    channels: BTreeMap<u16, Channel>,
    /// What the indexes of the chunks have to say, by the chunks' offsets.
    chunks: BTreeMap<u64, ChunkIndex>,
    /// Messages of the last chunk by channel.
    messages: BTreeMap<u16, Vec<MessageIndexEntry>>,
    /// Attachments and metadata records by their offsets: operation code, length and name.
    named: BTreeMap<u64, (u8, u64, String)>,
    counted: Counted,
    /// Where the data section ends.
    data_end: Option<u64>,
    /// Records behind it by their operation codes.
    summary: BTreeMap<u8, Group>,
}

/// The summary's records of one kind.
#[derive(Clone, Copy)]
struct Group {
    start: u64,
    end: u64,
    /// Whether nothing lies between them.
    is_contiguous: bool,
}

/// What the statistics have to say.
#[derive(Default)]
struct Counted {
    channels: BTreeMap<u16, u64>,
    attachments: u32,
    metadata: u32,
    times: Option<(u64, u64)>,
}

impl Whole {
    fn take(&mut self, opcode: u8, body: &[u8]) -> Result<(), Damage> {
        let end = self.offset + (RECORD_PREFIX + body.len()) as u64;
        if self.data_end.is_some() {
            let start = self.offset;
            let group = self.summary.entry(opcode).or_insert(Group {
                start,
                end: start,
                is_contiguous: true,
            });
            group.is_contiguous &= group.end == start;
            group.end = end;
        }
        match mcap::parse_record(opcode, body).map_err(Damage::stream)? {
            Record::Chunk { header, data } => self.chunk(header, &data, end),
            Record::Schema { header, .. } => self.schema(header.id, body),
            Record::Channel(channel) => self.channel(channel),
            Record::Message { header, .. } => {
                self.count(header.channel_id, header.sequence, header.log_time)
            }
            Record::MessageIndex(index) => self.message_index(index.channel_id, index.records, end),
            Record::Attachment { header, crc, .. } => {
                let calculated = crc32fast::hash(&body[..body.len().saturating_sub(4)]);
                if crc != 0 && crc != calculated {
                    return Err(Damage::Checksum {
                        of: "attachment",
                        saved: crc,
                        calculated,
                    });
                }
                self.counted.attachments += 1;
                self.name(opcode, end, header.name);
                Ok(())
            }
            Record::Metadata(metadata) => {
                self.counted.metadata += 1;
                self.name(opcode, end, metadata.name);
                Ok(())
            }
            Record::DataEnd(_) => {
                self.data_end = Some(end);
                Ok(())
            }
            Record::ChunkIndex(index) => self.chunk_index(index),
            Record::AttachmentIndex(index) => {
                let told = (op::ATTACHMENT, index.length, index.name);
                self.named("attachment index", index.offset, told)
            }
            Record::MetadataIndex(index) => {
                let told = (op::METADATA, index.length, index.name);
                self.named("metadata index", index.offset, told)
            }
            Record::Statistics(statistics) => self.statistics(&statistics),
            // Some recorders list kinds of which there are no records.
            Record::SummaryOffset(group) if group.group_length == 0 => {
                let found = self
                    .summary
                    .get(&group.group_opcode)
                    .map(|group| group.start);
                agree("summary offset", "empty group", None, found)
            }
            Record::SummaryOffset(group) => {
                let found = self.group(group.group_opcode);
                let told = (
                    group.group_start,
                    group.group_start.saturating_add(group.group_length),
                );
                agree("summary offset", "group", Some(told), found)
            }
            Record::Footer(footer) => {
                self.footer(footer.summary_start, footer.summary_offset_start)
            }
            Record::Header(_) | Record::Unknown { .. } => Ok(()),
        }
    }

    /// Schemas of one id are one and the same.
    fn schema(&mut self, id: u16, body: &[u8]) -> Result<(), Damage> {
        let record = "schema";
        match self.schemas.entry(id) {
            Entry::Occupied(known) if known.get() != body => Err(Damage::Redefined { record, id }),
            Entry::Occupied(_) => Ok(()),
            Entry::Vacant(new) => {
                new.insert(body.to_vec());
                Ok(())
            }
        }
    }

    /// So are channels.
    fn channel(&mut self, channel: Channel) -> Result<(), Damage> {
        let (id, schema) = (channel.id, channel.schema_id);
        if schema != 0 && !self.schemas.contains_key(&schema) {
            let channel = id;
            return Err(Damage::UnknownSchema { channel, schema });
        }
        let record = "channel";
        match self.channels.entry(id) {
            Entry::Occupied(known) if *known.get() != channel => {
                Err(Damage::Redefined { record, id })
            }
            Entry::Occupied(_) => Ok(()),
            Entry::Vacant(new) => {
                new.insert(channel);
                Ok(())
            }
        }
    }

    fn count(&mut self, channel: u16, sequence: u32, time: u64) -> Result<(), Damage> {
        if !self.channels.contains_key(&channel) {
            return Err(Damage::UnknownChannel { sequence, channel });
        }
        *self.counted.channels.entry(channel).or_default() += 1;
        let (first, last) = self.counted.times.unwrap_or((time, time));
        self.counted.times = Some((first.min(time), last.max(time)));
        Ok(())
    }

    fn name(&mut self, opcode: u8, end: u64, name: String) {
        let length = end - self.offset;
        self.named.insert(self.offset, (opcode, length, name));
    }

    fn chunk(&mut self, told: records::ChunkHeader, packed: &[u8], end: u64) -> Result<(), Damage> {
        let header = ChunkHeader {
            times: (told.message_start_time, told.message_end_time),
            length: told.uncompressed_size,
            checksum: told.uncompressed_crc,
            compression: told.compression,
            packed_length: told.compressed_size,
        };
        let records = chunk::unpack(&header, packed)?;
        self.messages.clear();
        let mut times: Option<(u64, u64)> = None;
        let mut offset = 0;
        while offset < records.len() {
            let (opcode, start, next) = walk::split(&records, offset)?;
            let body = &records[start..next];
            match opcode {
                op::SCHEMA | op::CHANNEL => self.take_definition(opcode, body)?,
                op::MESSAGE => {
                    let (message, _) = MessageHeader::parse(body)?;
                    let log_time = message.log_time;
                    self.count(message.channel, message.sequence, log_time)?;
                    let (first, last) = times.unwrap_or((log_time, log_time));
                    times = Some((first.min(log_time), last.max(log_time)));
                    let offset = offset as u64;
                    let entries = self.messages.entry(message.channel).or_default();
                    entries.push(MessageIndexEntry { log_time, offset });
                }
                _ => {}
            }
            offset = next;
        }
        let told = (told.message_start_time, told.message_end_time);
        let (start_time, end_time) = times.unwrap_or(told);
        agree("chunk", "log times", told, (start_time, end_time))?;
        let index = ChunkIndex {
            message_start_time: start_time,
            message_end_time: end_time,
            chunk_start_offset: self.offset,
            chunk_length: end - self.offset,
            message_index_offsets: BTreeMap::new(),
            message_index_length: 0,
            compression: header.compression,
            compressed_size: header.packed_length,
            uncompressed_size: header.length,
        };
        self.chunks.insert(self.offset, index);
        Ok(())
    }

    /// A definition within a chunk.
    fn take_definition(&mut self, opcode: u8, body: &[u8]) -> Result<(), Damage> {
        match mcap::parse_record(opcode, body).map_err(Damage::stream)? {
            Record::Schema { header, .. } => self.schema(header.id, body),
            Record::Channel(channel) => self.channel(channel),
            _ => Ok(()),
        }
    }

    /// The index of the last chunk's messages of a channel.
    fn message_index(
        &mut self,
        channel: u16,
        mut told: Vec<MessageIndexEntry>,
        end: u64,
    ) -> Result<(), Damage> {
        let key = |entry: &MessageIndexEntry| (entry.offset, entry.log_time);
        told.sort_by_key(key);
        let found = self.messages.get(&channel).map_or(&[][..], Vec::as_slice);
        let record = "message index";
        agree(record, "number of messages", told.len(), found.len())?;
        for (told, found) in told.iter().zip(found) {
            agree(record, "message", told, found)?;
        }
        if let Some((_, chunk)) = self.chunks.iter_mut().next_back() {
            chunk.message_index_offsets.insert(channel, self.offset);
            chunk.message_index_length += end - self.offset;
        }
        Ok(())
    }

    fn chunk_index(&self, told: ChunkIndex) -> Result<(), Damage> {
        let Some(found) = self.chunks.get(&told.chunk_start_offset) else {
            return Err(Damage::Disagrees {
                record: "chunk index",
                field: "offset",
                told: told.chunk_start_offset.to_string(),
                found: "no chunk there".into(),
            });
        };
        let times = |index: &ChunkIndex| (index.message_start_time, index.message_end_time);
        let sizes = |index: &ChunkIndex| (index.compressed_size, index.uncompressed_size);
        let record = "chunk index";
        agree(record, "log times", times(&told), times(found))?;
        agree(record, "length", told.chunk_length, found.chunk_length)?;
        agree(record, "compression", &told.compression, &found.compression)?;
        agree(record, "sizes", sizes(&told), sizes(found))?;
        // No offsets mean that the messages are not indexed.
        if told.message_index_offsets.is_empty() {
            return Ok(());
        }
        let indexes = |index: ChunkIndex| (index.message_index_length, index.message_index_offsets);
        agree(
            record,
            "message indexes",
            indexes(told),
            indexes(found.clone()),
        )
    }

    fn named(
        &self,
        record: &'static str,
        offset: u64,
        told: (u8, u64, String),
    ) -> Result<(), Damage> {
        agree(record, "record", Some(&told), self.named.get(&offset))
    }

    fn statistics(&self, told: &Statistics) -> Result<(), Damage> {
        let record = "statistics";
        let counted = &self.counted;
        let mut counts = told.channel_message_counts.clone();
        counts.retain(|_, count| *count > 0);
        let messages = counted.channels.values().sum::<u64>();
        agree(record, "messages", told.message_count, messages)?;
        agree(record, "messages by channel", &counts, &counted.channels)?;
        // Some recorders leave out a chunk without messages, and with it definitions that they have counted.
        let (schemas, channels) = (self.schemas.len(), self.channels.len());
        at_least(record, "schemas", told.schema_count.into(), schemas)?;
        at_least(record, "channels", told.channel_count as usize, channels)?;
        agree(
            record,
            "attachments",
            told.attachment_count,
            counted.attachments,
        )?;
        agree(
            record,
            "metadata records",
            told.metadata_count,
            counted.metadata,
        )?;
        agree(
            record,
            "chunks",
            told.chunk_count as usize,
            self.chunks.len(),
        )?;
        // Some recorders tell no times.
        match (told.message_start_time, told.message_end_time) {
            (0, 0) => Ok(()),
            times => agree(record, "log times", times, counted.times.unwrap_or(times)),
        }
    }

    /// Where the summary's records of a kind start and end, if they lie together.
    fn group(&self, opcode: u8) -> Option<(u64, u64)> {
        let group = self.summary.get(&opcode)?;
        group.is_contiguous.then_some((group.start, group.end))
    }

    fn footer(&self, summary: u64, offsets: u64) -> Result<(), Damage> {
        // The footer itself is one of them.
        let starts = self.summary.values().map(|group| group.start);
        let behind = starts.min().unwrap_or(0);
        let has_summary = self.summary.len() > 1;
        if summary != 0 || has_summary {
            agree("footer", "start of the summary", summary, behind)?;
        }
        let field = "start of the summary offsets";
        let found = match self.summary.get(&op::SUMMARY_OFFSET) {
            // Some recorders write none, and say that they end where they start: before the footer.
            None => Some(self.offset),
            Some(_) => self.group(op::SUMMARY_OFFSET).map(|(start, _)| start),
        };
        match offsets {
            0 => Ok(()),
            told => agree("footer", field, Some(told), found),
        }
    }
}

fn at_least(
    record: &'static str,
    field: &'static str,
    told: usize,
    found: usize,
) -> Result<(), Damage> {
    if told >= found {
        return Ok(());
    }
    agree(record, field, told, found)
}

fn agree<T: PartialEq + Debug>(
    record: &'static str,
    field: &'static str,
    told: T,
    found: T,
) -> Result<(), Damage> {
    if told == found {
        return Ok(());
    }
    Err(Damage::Disagrees {
        record,
        field,
        told: format!("{told:?}"),
        found: format!("{found:?}"),
    })
}
