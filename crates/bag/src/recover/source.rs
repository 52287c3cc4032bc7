use std::{
    fs::{File, TryLockError},
    io,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

use mcap::{MAGIC, records::op};

use super::RecoverError;
use crate::regular;

/// Length of the footer record and the end magic.
const END: u64 = 9 + 20 + MAGIC.len() as u64;

/// A file that may be damaged, with the size that it had when it was opened.
pub(super) struct Source {
    pub path: PathBuf,
    pub size: u64,
    file: File,
}

impl Source {
    /// Opens a file that no writer of this crate has open.
    pub fn open(path: &Path) -> Result<Self, RecoverError> {
        let open = || {
            let size = regular::length(path)?;
            Ok((File::open(path)?, size))
        };
        let (file, size) = open().map_err(RecoverError::read(path))?;
        // Writers of this crate hold a lock. A file system without locks cannot tell.
        if let Err(TryLockError::WouldBlock) = file.try_lock_shared() {
            return Err(RecoverError::BeingWritten {
                file: path.to_owned(),
            });
        }
        Ok(Self {
            path: path.to_owned(),
            size,
            file,
        })
    }

    /// At most `length` bytes from `offset` on; fewer at the end of the file.
    pub fn bytes(&self, offset: u64, length: usize) -> Result<Vec<u8>, RecoverError> {
        let left = self.size.saturating_sub(offset);
        let mut bytes = vec![0; length.min(usize::try_from(left).unwrap_or(length))];
        let mut read = 0;
        while read < bytes.len() {
            match self.file.read_at(&mut bytes[read..], offset + read as u64) {
                Ok(0) => break,
                Ok(more) => read += more,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(RecoverError::read(&self.path)(error)),
            }
        }
        bytes.truncate(read);
        Ok(bytes)
    }

    /// Returns true if the file starts with the MCAP magic, as far as it has been written.
    pub fn has_magic(&self) -> Result<bool, RecoverError> {
        Ok(MAGIC.starts_with(&self.bytes(0, MAGIC.len())?))
    }

    /// Returns true if the file ends with a footer and the MCAP magic.
    pub fn has_end(&self) -> Result<bool, RecoverError> {
        let Some(start) = self.size.checked_sub(END) else {
            return Ok(false);
        };
        let end = self.bytes(start, END as usize)?;
        Ok(end.first() == Some(&op::FOOTER) && end.ends_with(MAGIC))
    }
}
