//! Records of a file held against what others tell of them.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::{
    ChunkHeader, ChunkIndex, Footer, MessageIndex, MessageIndexEntry, Record, Statistics, op,
};

use super::contents::Contents;
use crate::{
    Damage,
    damage::agree,
    times::{Times, sum},
};

/// What has been read so far.
#[derive(Default)]
pub(super) struct Found {
    /// Messages of the last chunk by channel.
    pub messages: BTreeMap<u16, Vec<MessageIndexEntry>>,
    /// What the indexes of the chunks have to say, by the chunks' offsets.
    chunks: BTreeMap<u64, ChunkIndex>,
    /// Offsets of the chunks that have been told of.
    indexed: BTreeSet<u64>,
    /// Attachments and metadata records by their offsets: operation code, length and name.
    named: BTreeMap<u64, (u8, u64, String)>,
    is_data_over: bool,
    /// Records behind the data by their operation codes.
    summary: BTreeMap<u8, Group>,
}

/// The summary's records of one kind.
#[derive(Clone, Copy)]
struct Group {
    start: u64,
    end: u64,
    /// True if nothing lies between them.
    is_contiguous: bool,
}

impl Found {
    pub fn record(
        &mut self,
        offset: u64,
        length: u64,
        record: &Record<'_>,
        contents: &Contents,
    ) -> Result<(), Damage> {
        let opcode = record.opcode();
        if self.is_data_over {
            let group = self.summary.entry(opcode).or_insert(Group {
                start: offset,
                end: offset,
                is_contiguous: true,
            });
            group.is_contiguous &= group.end == offset;
            group.end = offset + length;
        }
        match record {
            Record::MessageIndex(index) => self.message_index(index, offset, length)?,
            Record::Attachment { header, .. } => {
                let record = (opcode, length, header.name.clone());
                self.named.insert(offset, record);
            }
            Record::Metadata(metadata) => {
                let record = (opcode, length, metadata.name.clone());
                self.named.insert(offset, record);
            }
            Record::DataEnd(_) => self.is_data_over = true,
            Record::ChunkIndex(index) => self.chunk_index(index)?,
            Record::AttachmentIndex(index) => {
                let told = (op::ATTACHMENT, index.length, index.name.clone());
                let found = self.named.get(&index.offset);
                agree("attachment index", "record", Some(&told), found)?;
            }
            Record::MetadataIndex(index) => {
                let told = (op::METADATA, index.length, index.name.clone());
                let found = self.named.get(&index.offset);
                agree("metadata index", "record", Some(&told), found)?;
            }
            Record::Statistics(statistics) => self.statistics(statistics, contents)?,
            // Some recorders list kinds of which there are no records.
            Record::SummaryOffset(group) if group.group_length == 0 => {
                let found = self.summary.get(&group.group_opcode);
                let found = found.map(|group| group.start);
                agree("summary offset", "empty group", None, found)?;
            }
            Record::SummaryOffset(group) => {
                let end = group.group_start.saturating_add(group.group_length);
                let told = Some((group.group_start, end));
                agree(
                    "summary offset",
                    "group",
                    told,
                    self.group(group.group_opcode),
                )?;
            }
            Record::Footer(footer) => self.footer(footer, offset)?,
            _ => {}
        }
        Ok(())
    }

    /// Takes a chunk whose messages are of these times.
    pub fn chunk(
        &mut self,
        offset: u64,
        length: u64,
        header: &ChunkHeader,
        times: Times,
    ) -> Result<(), Damage> {
        let told = (header.message_start_time, header.message_end_time);
        agree("chunk", "log times", told, times.unwrap_or(told))?;
        let index = ChunkIndex {
            message_start_time: told.0,
            message_end_time: told.1,
            chunk_start_offset: offset,
            chunk_length: length,
            message_index_offsets: BTreeMap::new(),
            message_index_length: 0,
            compression: header.compression.clone(),
            compressed_size: header.compressed_size,
            uncompressed_size: header.uncompressed_size,
        };
        self.chunks.insert(offset, index);
        Ok(())
    }

    /// The index of the last chunk's messages of a channel.
    fn message_index(
        &mut self,
        index: &MessageIndex,
        offset: u64,
        length: u64,
    ) -> Result<(), Damage> {
        let mut told = index.records.clone();
        told.sort_by_key(|entry| (entry.offset, entry.log_time));
        let found = self.messages.get(&index.channel_id);
        let found = found.map_or(&[][..], Vec::as_slice);
        let record = "message index";
        agree(record, "number of messages", told.len(), found.len())?;
        for (told, found) in told.iter().zip(found) {
            agree(record, "message", told, found)?;
        }
        if let Some(mut chunk) = self.chunks.last_entry() {
            let chunk = chunk.get_mut();
            chunk.message_index_offsets.insert(index.channel_id, offset);
            chunk.message_index_length += length;
        }
        Ok(())
    }

    fn chunk_index(&mut self, told: &ChunkIndex) -> Result<(), Damage> {
        let record = "chunk index";
        let offset = told.chunk_start_offset;
        let new = self.indexed.insert(offset).then_some(offset);
        agree(record, "chunk that is told of once", Some(offset), new)?;
        let Some(found) = self.chunks.get(&offset) else {
            return agree(record, "chunk", Some(offset), None);
        };
        // No offsets mean that the messages are not indexed.
        let mut found = found.clone();
        if told.message_index_offsets.is_empty() {
            found.message_index_offsets.clear();
            found.message_index_length = told.message_index_length;
        }
        agree(record, "chunk", told, &found)
    }

    fn statistics(&self, told: &Statistics, contents: &Contents) -> Result<(), Damage> {
        let record = "statistics";
        let mut counts = told.channel_message_counts.clone();
        counts.retain(|_, count| *count > 0);
        let found = contents.counts.clone().unwrap_or_default();
        let messages = sum(found.values().copied());
        agree(record, "messages", told.message_count, messages)?;
        agree(record, "messages by channel", counts, found)?;
        // Some recorders leave out a chunk without messages, and with it definitions that they have counted.
        let schemas = contents.schemas.len().max(told.schema_count.into());
        agree(record, "schemas", told.schema_count.into(), schemas)?;
        let channels = contents.channels.len().max(told.channel_count as usize);
        agree(record, "channels", told.channel_count as usize, channels)?;
        let named = |opcode| {
            self.named
                .values()
                .filter(|named| named.0 == opcode)
                .count()
        };
        let attachments = named(op::ATTACHMENT);
        agree(
            record,
            "attachments",
            told.attachment_count as usize,
            attachments,
        )?;
        let metadata = named(op::METADATA);
        agree(
            record,
            "metadata records",
            told.metadata_count as usize,
            metadata,
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
            times => agree(record, "log times", times, contents.times.unwrap_or(times)),
        }
    }

    /// Start and end of the summary's records of a kind, if they lie together.
    fn group(&self, opcode: u8) -> Option<(u64, u64)> {
        let group = self.summary.get(&opcode)?;
        group.is_contiguous.then_some((group.start, group.end))
    }

    fn footer(&self, told: &Footer, offset: u64) -> Result<(), Damage> {
        // The footer itself is one of them.
        let starts = self.summary.values().map(|group| group.start);
        let start = starts.min().unwrap_or(0);
        if told.summary_start != 0 || self.summary.len() > 1 {
            agree("footer", "start of the summary", told.summary_start, start)?;
        }
        let found = match self.summary.get(&op::SUMMARY_OFFSET) {
            // Some recorders write none, and say that they end where they start: before the footer.
            None => Some(offset),
            Some(_) => self.group(op::SUMMARY_OFFSET).map(|(start, _)| start),
        };
        match told.summary_offset_start {
            0 => Ok(()),
            told => agree("footer", "start of the summary offsets", Some(told), found),
        }
    }
}
