//! Bytes of one file, and errors that name it.

use std::{
    fs::{self, File, TryLockError},
    io::{self, ErrorKind, Read},
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
    error::limited,
    record::{self, PREFIX},
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
const STEP: u64 = 256 << 10;

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
        let mut source = Self::open_damaged(path)?;
        // Bags may have more files than a process may have open.
        source.open = None;
        if source.bytes(0, MAGIC_LENGTH)?.starts_with(ZSTD_MAGIC) {
            source.unpack().map_err(BagError::io(path))?;
        }
        source.refuse_other()?;
        let head = source.bytes(0, MAGIC_LENGTH)?;
        if head == MAGIC {
            return Ok(source);
        }
        Err(if MAGIC.starts_with(&head) {
            source.truncated("the MCAP magic", 0, &head)
        } else {
            let expected = "a bag: a directory with metadata.yaml, or an MCAP file";
            BagError::invalid(
                path,
                format!("this is not an MCAP file, expected {expected}"),
            )
        })
    }

    /// Opens a file whatever is in it, which stays open.
    pub fn open_damaged(path: &Path) -> Result<Self, BagError> {
        let metadata = fs::metadata(path).map_err(BagError::io(path))?;
        // Pipes and devices are waited for or never end.
        if !metadata.is_file() {
            let error = io::Error::new(ErrorKind::InvalidInput, "is not a regular file");
            return Err(BagError::io(path)(error));
        }
        let file = File::open(path).map_err(BagError::io(path))?;
        Ok(Self {
            path: path.to_owned(),
            size: metadata.len(),
            open: Some(file),
        })
    }

    /// Refuses a file that starts like those of other storages.
    pub fn refuse_other(&self) -> Result<(), BagError> {
        let head = self.bytes(0, 16)?;
        let mut others = OTHER_STORAGES.iter();
        match others.find(|(start, _)| head.starts_with(start)) {
            None => Ok(()),
            Some((_, storage)) => Err(BagError::Storage {
                file: self.path.clone(),
                found: (*storage).to_owned(),
            }),
        }
    }

    /// Returns true if a writer of this crate has the file open. A file system without locks cannot tell.
    pub fn is_being_written(&self) -> bool {
        let locked = self.open.as_ref().map(File::try_lock_shared);
        matches!(locked, Some(Err(TryLockError::WouldBlock)))
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
        self.open = Some(unpacked);
        Ok(())
    }

    /// At most `length` bytes from `offset` on; fewer at the end of the file.
    pub fn bytes(&self, offset: u64, length: u64) -> Result<Vec<u8>, BagError> {
        let length = length.min(self.size.saturating_sub(offset));
        let mut bytes = vec![0; usize::try_from(length).unwrap_or(0)];
        let read = match &self.open {
            Some(file) => file.read_exact_at(&mut bytes, offset),
            None => File::open(&self.path).and_then(|file| file.read_exact_at(&mut bytes, offset)),
        };
        read.map(|()| bytes).map_err(BagError::io(&self.path))
    }

    /// Operation code and body of the record at `offset`, of at most `limit` bytes.
    pub fn record(&self, offset: u64, limit: usize) -> Result<(u8, Vec<u8>), BagError> {
        let cut = |found: &[u8]| self.truncated("a whole record", offset, found);
        let head = self.bytes(offset, PREFIX as u64)?;
        let Some((opcode, length)) = record::prefix(&head) else {
            return Err(cut(&head));
        };
        limited(opcode, length, limit).map_err(|damage| self.damaged(offset, damage))?;
        let body = self.bytes(offset + PREFIX as u64, length)?;
        match body.len() as u64 == length {
            true => Ok((opcode, body)),
            false => Err(cut(&head)),
        }
    }

    /// Gives `take` the records from the one at `start` on, or of the whole file from its magic on: offset, operation code
    /// and body.
    pub fn walk(
        &self,
        start: Option<u64>,
        options: LinearReaderOptions,
        mut take: impl FnMut(u64, u8, &[u8]) -> Result<ControlFlow<()>, Damage>,
    ) -> Result<(), BagError> {
        let options = options
            .with_skip_start_magic(start.is_some())
            .with_emit_chunks(true)
            .with_record_length_limit(MAX_PACKED_LENGTH);
        let mut position = start.unwrap_or(0);
        let mut offset = start.unwrap_or(MAGIC_LENGTH);
        let mut reader = LinearReader::new_with_options(options);
        while let Some(event) = reader.next_event() {
            match event {
                // As much as the record's length asks for may not be there.
                Ok(LinearReadEvent::ReadRequest(_)) => {
                    let bytes = self.bytes(position, STEP)?;
                    position += bytes.len() as u64;
                    reader.insert(bytes.len()).copy_from_slice(&bytes);
                    reader.notify_read(bytes.len());
                }
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    let taken = take(offset, opcode, data);
                    if taken.map_err(|it| self.damaged(offset, it))?.is_break() {
                        break;
                    }
                    offset += (PREFIX + data.len()) as u64;
                }
                Err(McapError::UnexpectedEof) => {
                    let found = self.bytes(offset, PREFIX as u64)?;
                    return Err(self.truncated("a whole record", offset, &found));
                }
                Err(error) => return Err(self.damaged(offset, error.into())),
            }
        }
        Ok(())
    }

    pub fn damaged(&self, offset: u64, source: Damage) -> BagError {
        BagError::Damaged {
            file: self.path.clone(),
            offset,
            source,
        }
    }

    /// For a file that is cut off.
    pub fn truncated(&self, expected: &str, offset: u64, found: &[u8]) -> BagError {
        let found = format!("found {found:02x?} at the end of {} bytes", self.size);
        let text =
            format!("truncated: expected {expected}, {found}; what is readable: lgvi recover");
        self.damaged(offset, Damage(text))
    }
}
