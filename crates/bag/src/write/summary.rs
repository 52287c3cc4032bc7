//! The end of an MCAP file: summary section, summary offsets, footer and magic.

use std::collections::BTreeMap;

use mcap::{MAGIC, records::op};

use super::{catalog::Catalog, chunk::ChunkIndex, encode};

/// Where a metadata record is.
pub(crate) struct MetadataIndex {
    pub offset: u64,
    length: u64,
    name: &'static str,
}

impl MetadataIndex {
    /// Appends a metadata record to bytes that come at `offset` of the file.
    pub fn encode(
        out: &mut Vec<u8>,
        offset: u64,
        name: &'static str,
        texts: &BTreeMap<String, String>,
    ) -> Self {
        let start = out.len();
        encode::record(out, op::METADATA, |out| {
            encode::bytes(out, name.as_bytes());
            encode::sized(out, |out| encode::texts(out, texts));
        });
        Self {
            offset: offset + start as u64,
            length: (out.len() - start) as u64,
            name,
        }
    }
}

/// What the summary tells.
pub(crate) struct Summary<'a, M> {
    pub catalog: &'a Catalog,
    pub compression: &'static str,
    pub chunks: &'a [ChunkIndex],
    pub metadata: M,
    /// Number of messages of each channel, which are counted from 1.
    pub counts: &'a [u64],
    /// First and last log time (ns).
    pub times: Option<(u64, u64)>,
}

impl<'a, M: Iterator<Item = &'a MetadataIndex> + Clone> Summary<'a, M> {
    /// Appends the summary to what comes after the first `offset` bytes of the file.
    pub fn encode(&self, out: &mut Vec<u8>, offset: u64) {
        let summary = out.len();
        let mut groups = Groups::default();
        groups.add(out, op::SCHEMA, |out| {
            out.extend_from_slice(self.catalog.schemas());
        });
        groups.add(out, op::CHANNEL, |out| {
            out.extend_from_slice(self.catalog.channels());
        });
        groups.add(out, op::STATISTICS, |out| self.encode_statistics(out));
        groups.add(out, op::CHUNK_INDEX, |out| {
            for chunk in self.chunks {
                chunk.encode(out, self.compression);
            }
        });
        groups.add(out, op::METADATA_INDEX, |out| {
            for index in self.metadata.clone() {
                encode::record(out, op::METADATA_INDEX, |out| {
                    encode::u64(out, index.offset);
                    encode::u64(out, index.length);
                    encode::bytes(out, index.name.as_bytes());
                });
            }
        });
        let offsets = out.len();
        groups.encode(out, offset);

        encode::record(out, op::FOOTER, |out| {
            encode::u64(out, offset + summary as u64);
            encode::u64(out, offset + offsets as u64);
            encode::u32(out, 0);
        });
        // The checksum covers the summary and the footer up to the checksum itself.
        let checksum = out.len() - 4;
        let value = crc32fast::hash(&out[summary..checksum]);
        out[checksum..].copy_from_slice(&value.to_le_bytes());
        out.extend_from_slice(MAGIC);
    }

    fn encode_statistics(&self, out: &mut Vec<u8>) {
        let (first, last) = self.times.unwrap_or_default();
        encode::record(out, op::STATISTICS, |out| {
            encode::u64(out, self.counts.iter().sum());
            encode::u16(out, self.catalog.schema_count());
            encode::u32(out, u32::from(self.catalog.channel_count()));
            encode::u32(out, 0);
            encode::u32(out, self.metadata.clone().count() as u32);
            encode::u32(out, self.chunks.len() as u32);
            encode::u64(out, first);
            encode::u64(out, last);
            encode::sized(out, |out| {
                for (channel, &count) in (1..).zip(self.counts).filter(|&(_, &count)| count > 0) {
                    encode::u16(out, channel);
                    encode::u64(out, count);
                }
            });
        });
    }
}

/// Where the records of each kind are in the summary: kind, start and length in the bytes encoded.
#[derive(Default)]
struct Groups(Vec<(u8, usize, usize)>);

impl Groups {
    fn add(&mut self, out: &mut Vec<u8>, opcode: u8, write: impl FnOnce(&mut Vec<u8>)) {
        let start = out.len();
        write(out);
        if out.len() > start {
            self.0.push((opcode, start, out.len() - start));
        }
    }

    fn encode(&self, out: &mut Vec<u8>, offset: u64) {
        for &(opcode, start, length) in &self.0 {
            encode::record(out, op::SUMMARY_OFFSET, |out| {
                out.push(opcode);
                encode::u64(out, offset + start as u64);
                encode::u64(out, length as u64);
            });
        }
    }
}
