//! One record after the other, of a file or of a chunk in memory.

use std::io::{self, BufReader, ErrorKind, Read};

use crc32fast::Hasher;

use super::{
    MAX_RECORD_LENGTH, RECORD_PREFIX,
    source::{Section, Source},
};
use crate::{BagError, Damage, records::ChunkHeader};

/// Longest name of a compression.
const MAX_NAME_LENGTH: usize = 64;

/// Operation code of a record and length of its body, which lies after [`RECORD_PREFIX`] bytes.
#[derive(Clone, Copy)]
pub(crate) struct Prefix {
    pub opcode: u8,
    pub length: u64,
    pub offset: u64,
}

impl Prefix {
    fn parse(bytes: [u8; RECORD_PREFIX], offset: u64) -> Self {
        let [opcode, length @ ..] = bytes;
        Self {
            opcode,
            length: u64::from_le_bytes(length),
            offset,
        }
    }

    /// Where the next record starts.
    pub fn end(&self) -> u64 {
        (self.offset + RECORD_PREFIX as u64).saturating_add(self.length)
    }

    /// The length, if so much is read into memory.
    pub fn limited(&self, limit: usize) -> Result<usize, Damage> {
        let length = usize::try_from(self.length).ok();
        length
            .filter(|length| *length <= limit)
            .ok_or(Damage::TooLong {
                opcode: self.opcode,
                length: self.length,
                limit,
            })
    }
}

/// Records of a section of a file.
pub(crate) struct Records<'a> {
    source: &'a Source,
    reader: BufReader<Section>,
    /// Where the next record, or the rest of the present one, starts.
    offset: u64,
    body: Vec<u8>,
    checksum: Hasher,
}

impl<'a> Records<'a> {
    pub fn new(source: &'a Source, reader: BufReader<Section>, offset: u64) -> Self {
        Self {
            source,
            reader,
            offset,
            body: Vec::new(),
            checksum: Hasher::new(),
        }
    }

    /// The next record, of which body or skip has to be called; none at the end of the section.
    pub fn next(&mut self) -> Result<Option<Prefix>, BagError> {
        let mut bytes = [0; RECORD_PREFIX];
        let offset = self.offset;
        let read = self.read_up_to(&mut bytes)?;
        if read == 0 {
            return Ok(None);
        }
        if read < RECORD_PREFIX {
            return Err(self.cut(offset, bytes[..read].to_vec()));
        }
        Ok(Some(Prefix::parse(bytes, offset)))
    }

    /// The first bytes of a record, so many as there are, at most `N`.
    pub fn start<const N: usize>(&mut self, prefix: Prefix) -> Result<([u8; N], usize), BagError> {
        let mut bytes = [0; N];
        let length = usize::try_from(prefix.length).map_or(N, |length| length.min(N));
        let read = self.read_up_to(&mut bytes[..length])?;
        if read < length {
            return Err(self.cut(prefix.offset, bytes[..read].to_vec()));
        }
        Ok((bytes, length))
    }

    /// The body of a record.
    pub fn body(&mut self, prefix: Prefix) -> Result<&[u8], BagError> {
        let length = prefix
            .limited(MAX_RECORD_LENGTH)
            .map_err(|damage| self.source.damaged(prefix.offset, damage))?;
        self.body.clear();
        let read = (&mut self.reader)
            .take(length as u64)
            .read_to_end(&mut self.body)
            .map_err(|error| self.source.io_error(error))?;
        if read < length {
            return Err(self.cut(prefix.offset, Vec::new()));
        }
        self.checksum.update(&self.body);
        self.offset += length as u64;
        Ok(&self.body)
    }

    /// Reads over what is left of a record.
    pub fn skip(&mut self, prefix: Prefix) -> Result<(), BagError> {
        let mut buffer = [0; 4 << 10];
        while self.offset < prefix.end() {
            let left = usize::try_from(prefix.end() - self.offset).unwrap_or(usize::MAX);
            let length = left.min(buffer.len());
            if self.read_up_to(&mut buffer[..length])? < length {
                return Err(self.cut(prefix.offset, Vec::new()));
            }
        }
        Ok(())
    }

    /// The fields of a chunk record before the packed records, which are read next.
    pub fn chunk_header(&mut self, prefix: Prefix) -> Result<ChunkHeader, BagError> {
        let damaged = |damage| self.source.damaged(prefix.offset, damage);
        let (fixed, length) = self.start::<{ ChunkHeader::FIXED }>(prefix)?;
        let name_length = ChunkHeader::name_length(&fixed[..length]).map_err(damaged)?;
        if name_length > MAX_NAME_LENGTH {
            let found = format!("a name of {name_length} bytes");
            return Err(damaged(Damage::Compression { found }));
        }
        let mut bytes = fixed.to_vec();
        bytes.resize(ChunkHeader::FIXED + name_length + size_of::<u64>(), 0);
        let read = self.read_up_to(&mut bytes[ChunkHeader::FIXED..])?;
        let damaged = |damage| self.source.damaged(prefix.offset, damage);
        let header = ChunkHeader::parse(&bytes[..ChunkHeader::FIXED + read]).map_err(damaged)?;
        let left = prefix.end().saturating_sub(self.offset);
        if header.packed_length > left {
            return Err(damaged(Damage::OutOfRange {
                record: "chunk",
                offset: self.offset,
                length: header.packed_length,
                end: prefix.end(),
            }));
        }
        Ok(header)
    }

    /// Checksum of all that has been read.
    pub fn checksum(&self) -> u32 {
        self.checksum.clone().finalize()
    }

    fn read_up_to(&mut self, buffer: &mut [u8]) -> Result<usize, BagError> {
        let mut read = 0;
        while read < buffer.len() {
            match self.reader.read(&mut buffer[read..]) {
                Ok(0) => break,
                Ok(count) => read += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(self.source.io_error(error)),
            }
        }
        self.checksum.update(&buffer[..read]);
        self.offset += read as u64;
        Ok(read)
    }

    fn cut(&self, offset: u64, found: Vec<u8>) -> BagError {
        self.source.truncated("a whole record", offset, found)
    }
}

impl Read for Records<'_> {
    /// Reads the present record's body.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.reader.read(buffer)?;
        self.checksum.update(&buffer[..read]);
        self.offset += read as u64;
        Ok(read)
    }
}

/// Takes the record that starts at `offset` of bytes in memory: its operation code, and where its body starts and ends.
pub(crate) fn split(bytes: &[u8], offset: usize) -> Result<(u8, usize, usize), Damage> {
    let left = &bytes[offset..];
    let short = |needed| Damage::Short {
        record: "chunk",
        needed,
        left: left.len(),
    };
    let Some((prefix, body)) = left.split_first_chunk::<RECORD_PREFIX>() else {
        return Err(short(RECORD_PREFIX));
    };
    let prefix = Prefix::parse(*prefix, offset as u64);
    let length = prefix.limited(MAX_RECORD_LENGTH)?;
    if length > body.len() {
        return Err(short(length));
    }
    let start = offset + RECORD_PREFIX;
    Ok((prefix.opcode, start, start + length))
}
