//! Bytes of one file, and errors that name it.

use std::{
    fs::{File, TryLockError},
    io::{self, ErrorKind, Read, Seek, SeekFrom},
    ops::ControlFlow,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

use mcap::{
    MAGIC, McapError,
    sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

use super::{MAGIC_LENGTH, MAX_PACKED_LENGTH};
use crate::{
    BagError, Damage,
    damage::limited,
    record::{self, PREFIX},
    regular,
};

/// First bytes of a zstd frame, and of no CDR message: there is no such encapsulation.
pub(crate) const ZSTD_MAGIC: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];

/// First bytes of files of other storages, and their names.
const OTHER_STORAGES: [(&[u8], &str); 2] = [
    (b"SQLite format 3\0", "sqlite3"),
    (b"#ROSBAG V", "ROS 1 bag"),
];

/// Bytes that a compressed file may grow to beyond [`LARGEST_RATIO`] times its length.
const LEAST_UNPACKED: u64 = 1 << 30;

/// More than bags compress by: a file that unpacks to more is refused before it fills the disk.
const LARGEST_RATIO: u64 = 256;

/// Bytes that are read at once.
const STEP: usize = 64 << 10;

/// A file, or the temporary file that it was unpacked into.
pub(crate) struct Source {
    pub path: PathBuf,
    pub size: u64,
    /// The file that is read, if it stays open.
    open: Option<File>,
}

impl Source {
    /// Opens a file that starts as MCAP files do.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let mut source = Self {
            path: path.to_owned(),
            size: 0,
            open: None,
        };
        source.size = regular::length(path).map_err(|error| source.io_error(error))?;
        let mut head = source.bytes(0, 16)?;
        if head.starts_with(ZSTD_MAGIC) {
            source.unpack().map_err(|error| source.io_error(error))?;
            head = source.bytes(0, 16)?;
        }
        refuse_other(path, &head)?;
        head.truncate(MAGIC.len());
        if head == MAGIC {
            return Ok(source);
        }
        Err(if MAGIC.starts_with(&head) {
            source.truncated("the MCAP magic", 0, head)
        } else {
            let expected = format!("{MAGIC:02x?}");
            BagError::unexpected(
                path,
                "not an MCAP file: its start",
                format!("{head:02x?}"),
                expected,
            )
        })
    }

    /// Opens a file whatever is in it, which stays open.
    pub fn open_damaged(path: &Path) -> Result<Self, BagError> {
        let open = || Ok((regular::length(path)?, File::open(path)?));
        let (size, file) = open().map_err(BagError::io(path))?;
        Ok(Self {
            path: path.to_owned(),
            size,
            open: Some(file),
        })
    }

    /// Locks the file, if it stays open, against writers of this crate.
    pub fn try_lock_shared(&self) -> Result<(), TryLockError> {
        self.open.as_ref().map_or(Ok(()), File::try_lock_shared)
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
        self.open = Some(unpacked);
        Ok(())
    }

    /// The bytes from `offset` on.
    fn section(&self, offset: u64) -> io::Result<Section> {
        let file = match &self.open {
            Some(file) => file.try_clone(),
            None => File::open(&self.path),
        };
        file.map(|file| Section { file, offset })
    }

    /// At most `length` bytes from `offset` on; fewer at the end of the file.
    pub fn bytes(&self, offset: u64, length: u64) -> Result<Vec<u8>, BagError> {
        let length = length.min(self.size.saturating_sub(offset));
        let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
        let section = self.section(offset);
        let read = section.and_then(|section| section.take(length).read_to_end(&mut bytes));
        read.map(|_| bytes).map_err(|error| self.io_error(error))
    }

    /// Operation code and body of the record at `offset`, of at most `limit` bytes.
    pub fn record(&self, offset: u64, limit: usize) -> Result<(u8, Vec<u8>), BagError> {
        let cut = |found| self.truncated("a whole record", offset, found);
        let head = self.bytes(offset, PREFIX as u64)?;
        let Some((opcode, length)) = record::prefix(&head) else {
            return Err(cut(head));
        };
        limited(opcode, length, limit).map_err(|damage| self.damaged(offset, damage))?;
        let body = self.bytes(offset + PREFIX as u64, length)?;
        if (body.len() as u64) < length {
            return Err(cut(head));
        }
        Ok((opcode, body))
    }

    /// Gives `take` the records from the one at `start` on, or of the whole file from its magic on: offset, operation code
    /// and body.
    pub fn walk(
        &self,
        start: Option<u64>,
        options: LinearReaderOptions,
        mut take: impl FnMut(u64, u8, &[u8]) -> Result<ControlFlow<()>, BagError>,
    ) -> Result<(), BagError> {
        let options = options
            .with_skip_start_magic(start.is_some())
            .with_emit_chunks(true)
            .with_record_length_limit(MAX_PACKED_LENGTH);
        let mut offset = start.unwrap_or(MAGIC_LENGTH);
        let section = self.section(start.unwrap_or(0));
        let mut section = section.map_err(|error| self.io_error(error))?;
        let mut reader = LinearReader::new_with_options(options);
        while let Some(event) = reader.next_event() {
            match event {
                // As much as the record's length asks for may not be there.
                Ok(LinearReadEvent::ReadRequest(_)) => {
                    let read = section.read(reader.insert(STEP));
                    reader.notify_read(read.map_err(|error| self.io_error(error))?);
                }
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    if take(offset, opcode, data)?.is_break() {
                        break;
                    }
                    offset += (PREFIX + data.len()) as u64;
                }
                Err(McapError::UnexpectedEof) => {
                    let found = self.bytes(offset, PREFIX as u64)?;
                    return Err(self.truncated("a whole record", offset, found));
                }
                Err(error) => return Err(self.damaged(offset, error.into())),
            }
        }
        Ok(())
    }

    pub fn io_error(&self, source: io::Error) -> BagError {
        BagError::io(&self.path)(source)
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

/// Refuses a file that starts like those of other storages.
pub(crate) fn refuse_other(path: &Path, head: &[u8]) -> Result<(), BagError> {
    let mut others = OTHER_STORAGES.iter();
    match others.find(|(start, _)| head.starts_with(start)) {
        None => Ok(()),
        Some((_, storage)) => Err(BagError::Storage {
            file: path.to_owned(),
            found: (*storage).to_owned(),
        }),
    }
}

/// A part of an open file, which several may read at once.
struct Section {
    file: File,
    offset: u64,
}

impl Read for Section {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            match self.file.read_at(buffer, self.offset) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                read => {
                    self.offset += *read.as_ref().unwrap_or(&0) as u64;
                    return read;
                }
            }
        }
    }
}
