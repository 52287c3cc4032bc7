//! Chunks: their header, and the records in them.

use std::io::Read;

use mcap::records::op;

use crate::read::MAX_CHUNK_LENGTH;

/// Longest name of a compression that is known.
const NAME: usize = 4;

/// Header of a chunk before the name of its compression, with the name's length.
const BEFORE_NAME: usize = 8 + 8 + 8 + 4 + 4;

/// Header of a chunk with the longest name.
pub(super) const HEADER: usize = BEFORE_NAME + NAME + 8;

/// A page of the file systems that leave pages unwritten when the power fails.
const PAGE: u64 = 4096;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    None,
    Zstd,
    Lz4,
}

/// What a chunk says of itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChunkHeader {
    /// First and last log time (ns).
    pub times: (u64, u64),
    pub uncompressed_size: u64,
    /// Checksum of the uncompressed records; zero: none.
    pub checksum: u32,
    pub packing: Packing,
    /// Length of the header.
    pub length: u64,
    /// Length of the records as they are in the file.
    pub data_length: u64,
}

impl ChunkHeader {
    /// Parses the body of a chunk, of which more than the header need not be there.
    pub fn parse(body: &[u8]) -> Option<Self> {
        let u64_at = |at: usize| Some(u64::from_le_bytes(*body.get(at..)?.first_chunk()?));
        let u32_at = |at: usize| Some(u32::from_le_bytes(*body.get(at..)?.first_chunk()?));
        let name_length = usize::try_from(u32_at(28)?).ok()?;
        if name_length > NAME {
            return None;
        }
        let packing = match body.get(BEFORE_NAME..BEFORE_NAME + name_length)? {
            b"" | b"none" => Packing::None,
            b"zstd" => Packing::Zstd,
            b"lz4" => Packing::Lz4,
            _ => return None,
        };
        Some(Self {
            times: (u64_at(0)?, u64_at(8)?),
            uncompressed_size: u64_at(16)?,
            checksum: u32_at(24)?,
            packing,
            length: (BEFORE_NAME + name_length + 8) as u64,
            data_length: u64_at(BEFORE_NAME + name_length)?,
        })
    }

    /// Unpacks all records; an error says why they are not what was written.
    pub fn unpack(&self, data: &[u8]) -> Result<Vec<u8>, String> {
        let (records, outcome) = unpack(self.packing, data);
        outcome?;
        if records.len() as u64 != self.uncompressed_size {
            return Err(format!(
                "the chunk holds {} bytes, its header says {}",
                records.len(),
                self.uncompressed_size
            ));
        }
        let found = crc32fast::hash(&records);
        if self.checksum != 0 && found != self.checksum {
            return Err(format!(
                "the chunk's checksum is {found:08x}, its header says {:08x}",
                self.checksum
            ));
        }
        Ok(records)
    }

    /// Unpacks what can be unpacked of a chunk that the end of the file has cut off; the last record may be incomplete.
    pub fn unpack_start(&self, data: &[u8], offset: u64) -> Vec<u8> {
        unpack(self.packing, written(data, offset)).0
    }
}

/// What has been written of bytes that start at `offset` of the file: a file system may have grown the file and not
/// written all of its pages.
fn written(data: &[u8], offset: u64) -> &[u8] {
    let mut start = (PAGE - offset % PAGE) as usize % PAGE as usize;
    let mut end = data.len();
    while let Some(page) = data.get(start..start + PAGE as usize) {
        if page.iter().all(|&byte| byte == 0) {
            end = start;
            break;
        }
        start += PAGE as usize;
    }
    let zeros = data[..end].iter().rev().take_while(|&&byte| byte == 0);
    &data[..end - zeros.count()]
}

/// What comes out, and why no more did.
fn unpack(packing: Packing, data: &[u8]) -> (Vec<u8>, Result<(), String>) {
    let mut records = Vec::new();
    let outcome = match packing {
        Packing::None => {
            records.extend_from_slice(data);
            Ok(())
        }
        Packing::Zstd => zstd::stream::read::Decoder::with_buffer(data).and_then(|mut decoder| {
            decoder.window_log_max(26)?;
            limited(&mut decoder, &mut records)
        }),
        Packing::Lz4 => {
            lz4::Decoder::new(data).and_then(|mut decoder| limited(&mut decoder, &mut records))
        }
    };
    (
        records,
        outcome.map_err(|error| format!("the chunk cannot be unpacked: {error}")),
    )
}

/// Reads on with what came before the error, unlike `read_to_end` in steps that never grow by much.
fn limited(reader: &mut impl Read, records: &mut Vec<u8>) -> std::io::Result<()> {
    let mut step = vec![0; 64 << 10];
    loop {
        match reader.read(&mut step)? {
            0 => return Ok(()),
            read if records.len() + read > MAX_CHUNK_LENGTH => {
                return Err(std::io::Error::other(format!(
                    "it holds more than {MAX_CHUNK_LENGTH} bytes"
                )));
            }
            read => records.extend_from_slice(&step[..read]),
        }
    }
}

/// The complete records of an unpacked chunk, each with its operation code; a cut-off one ends them.
pub(super) struct Records<'a>(pub &'a [u8]);

impl<'a> Iterator for Records<'a> {
    type Item = (u8, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (opcode, body, rest) = record(self.0)?;
        matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | 0x80..).then_some(())?;
        self.0 = rest;
        Some((opcode, body))
    }
}

/// The first of several records and the others: operation code, body, rest.
pub(super) fn record(records: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let (prefix, rest) = records.split_first_chunk::<9>()?;
    let [opcode, length @ ..] = *prefix;
    let length = usize::try_from(u64::from_le_bytes(length)).ok()?;
    let (body, rest) = rest.split_at_checked(length)?;
    Some((opcode, body, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_that_were_never_written_are_not_believed() {
        let mut data = vec![7; 20_000];
        assert_eq!(written(&data, 100).len(), 20_000);
        data[19_990..].fill(0);
        assert_eq!(written(&data, 100).len(), 19_990);
        // The file's page from 8192 on.
        data[8092..8092 + 4096].fill(0);
        assert_eq!(written(&data, 100).len(), 8092);
        // Zeros that are no whole page are data.
        data[8092] = 1;
        assert_eq!(written(&data, 100).len(), 19_990);
    }
}
