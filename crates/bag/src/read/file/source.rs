//! Bytes of one file, and errors that name it.

use std::{
    fs::File,
    io::{self, BufReader, ErrorKind, Read, Seek, SeekFrom},
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

use mcap::MAGIC;

use super::{MAGIC_LENGTH, walk::Records};
use crate::{BagError, Damage, regular};

/// First bytes of a zstd frame, and of no CDR message: there is no such encapsulation.
pub(crate) const ZSTD_MAGIC: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];

/// First bytes of what bags were stored in before, and the storage's name.
pub(crate) const OTHER_STORAGES: [(&[u8], &str); 2] = [
    (b"SQLite format 3\0", "sqlite3"),
    (b"#ROSBAG V", "ROS 1 bag"),
];

/// Bytes that a compressed file may grow to beyond [`LARGEST_RATIO`] times its length.
const LEAST_UNPACKED: u64 = 1 << 30;

/// More than bags compress by: a file that unpacks to more is refused before it fills the disk.
const LARGEST_RATIO: u64 = 256;

/// An MCAP file, or the temporary file that it was unpacked into.
pub(crate) struct Source {
    pub path: PathBuf,
    pub size: u64,
    unpacked: Option<File>,
}

impl Source {
    /// A file that starts as MCAP files do.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let mut source = Self {
            path: path.to_owned(),
            size: 0,
            unpacked: None,
        };
        source.size = regular::length(path).map_err(|error| source.io_error(error))?;
        let mut head = source.bytes(0, 16)?;
        if head.starts_with(ZSTD_MAGIC) {
            source.unpack().map_err(|error| source.io_error(error))?;
            head = source.bytes(0, 16)?;
        }
        for (start, storage) in OTHER_STORAGES {
            if head.starts_with(start) {
                return Err(BagError::Storage {
                    file: path.to_owned(),
                    found: storage.to_owned(),
                });
            }
        }
        head.truncate(MAGIC.len());
        if head == MAGIC {
            return Ok(source);
        }
        Err(if MAGIC.starts_with(&head) {
            source.truncated("the MCAP magic", 0, head)
        } else {
            BagError::NotMcap {
                file: path.to_owned(),
                found: head,
            }
        })
    }

    /// Decompresses the file into a temporary one.
    fn unpack(&mut self) -> io::Result<()> {
        let limit = LEAST_UNPACKED.max(self.size.saturating_mul(LARGEST_RATIO));
        let decoder = zstd::Decoder::new(File::open(&self.path)?)?;
        let mut unpacked = tempfile::tempfile()?;
        self.size = io::copy(&mut decoder.take(limit + 1), &mut unpacked)?;
        if self.size > limit {
            let text = format!("unpacks to more than {limit} bytes");
            return Err(io::Error::new(ErrorKind::FileTooLarge, text));
        }
        unpacked.seek(SeekFrom::Start(0))?;
        self.unpacked = Some(unpacked);
        Ok(())
    }

    /// At most `length` bytes from `offset` on.
    pub fn section(&self, offset: u64, length: u64) -> Result<BufReader<Section>, BagError> {
        let file = match &self.unpacked {
            Some(file) => file.try_clone(),
            None => File::open(&self.path),
        };
        let file = file.map_err(|error| self.io_error(error))?;
        let end = offset.saturating_add(length);
        Ok(BufReader::with_capacity(
            64 << 10,
            Section { file, offset, end },
        ))
    }

    /// The records of a section.
    pub fn records(&self, offset: u64, length: u64) -> Result<Records<'_>, BagError> {
        Ok(Records::new(self, self.section(offset, length)?, offset))
    }

    /// At most `length` bytes from `offset` on, in memory.
    pub fn bytes(&self, offset: u64, length: u64) -> Result<Vec<u8>, BagError> {
        let mut bytes = Vec::new();
        self.section(offset, length)?
            .read_to_end(&mut bytes)
            .map_err(|error| self.io_error(error))?;
        Ok(bytes)
    }

    /// Where the end magic has to be.
    pub fn end_magic(&self) -> u64 {
        self.size.saturating_sub(MAGIC_LENGTH)
    }

    pub fn io_error(&self, source: io::Error) -> BagError {
        BagError::Io {
            path: self.path.clone(),
            source,
        }
    }

    pub fn damaged(&self, offset: u64, source: Damage) -> BagError {
        BagError::Damaged {
            file: self.path.clone(),
            offset,
            source,
        }
    }

    pub fn truncated(&self, expected: &'static str, offset: u64, found: Vec<u8>) -> BagError {
        BagError::Truncated {
            file: self.path.clone(),
            expected,
            offset,
            found,
            size: self.size,
        }
    }
}

/// A part of an open file, which several may read at once.
pub(crate) struct Section {
    file: File,
    offset: u64,
    end: u64,
}

impl Read for Section {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = usize::try_from(self.end - self.offset).unwrap_or(usize::MAX);
        let length = buffer.len().min(left);
        let read = self.file.read_at(&mut buffer[..length], self.offset)?;
        self.offset += read as u64;
        Ok(read)
    }
}
