//! Records of a file held against what others tell of them.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::{
    ChunkHeader, ChunkIndex, MessageIndex, MessageIndexEntry, Record, Statistics, op,
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
        match record {
            Record::MessageIndex(index) => self.message_index(index, offset, length)?,
            Record::Attachment { header, .. } => {
                let named = (opcode, length, header.name.clone());
                self.named.insert(offset, named);
            }
            Record::Metadata(metadata) => {
                let named = (opcode, length, metadata.name.clone());
                self.named.insert(offset, named);
            }
            Record::ChunkIndex(index) => self.chunk_index(index)?,
            Record::AttachmentIndex(index) => {
                let told = (op::ATTACHMENT, index.length, index.name.clone());
                self.named_index("attachment index", index.offset, &told)?;
            }
            Record::MetadataIndex(index) => {
                let told = (op::METADATA, index.length, index.name.clone());
                self.named_index("metadata index", index.offset, &told)?;
            }
            Record::Statistics(statistics) => self.statistics(statistics, contents)?,
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

    fn named_index(
        &self,
        record: &'static str,
        offset: u64,
        told: &(u8, u64, String),
    ) -> Result<(), Damage> {
        agree(record, "record", Some(told), self.named.get(&offset))
    }

    fn statistics(&self, told: &Statistics, contents: &Contents) -> Result<(), Damage> {
        let record = "statistics";
        let mut counts = told.channel_message_counts.clone();
        counts.retain(|_, count| *count > 0);
        let found = contents.counts.clone().unwrap_or_default();
        let messages = sum(found.values().copied());
        agree(record, "messages", told.message_count, messages)?;
        agree(record, "messages by channel", counts, found)?;
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
}
