use std::{
    fs::{File, TryLockError},
    io,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

use super::RecoverError;
use crate::regular;

/// Bytes read at once.
const WINDOW: usize = 64 << 10;

/// A file that may be damaged, of the size that it had when it was opened.
pub(super) struct Source {
    pub path: PathBuf,
    pub size: u64,
    file: File,
    window: Vec<u8>,
    start: u64,
}

impl Source {
    pub fn open(path: &Path) -> Result<Self, RecoverError> {
        let open = || {
            let size = regular::length(path)?;
            Ok((File::open(path)?, size))
        };
        let (file, size) = open().map_err(RecoverError::read(path))?;
        // Writers of this crate hold a lock. File systems without locks cannot tell.
        if let Err(TryLockError::WouldBlock) = file.try_lock_shared() {
            return Err(RecoverError::BeingWritten {
                file: path.to_owned(),
            });
        }
        Ok(Self {
            path: path.to_owned(),
            size,
            file,
            window: Vec::new(),
            start: 0,
        })
    }

    /// The bytes from `offset` on; fewer than `length` where the file ends before.
    pub fn view(&mut self, offset: u64, length: usize) -> Result<&[u8], RecoverError> {
        let length =
            length.min(usize::try_from(self.size.saturating_sub(offset)).unwrap_or(length));
        let end = self.start + self.window.len() as u64;
        if offset < self.start || offset + length as u64 > end {
            let wanted = (length.max(WINDOW) as u64).min(self.size.saturating_sub(offset));
            self.window.resize(wanted as usize, 0);
            self.window.shrink_to(WINDOW.max(length));
            let read = read_at(&self.file, offset, &mut self.window)
                .map_err(RecoverError::read(&self.path))?;
            self.window.truncate(read);
            self.start = offset;
        }
        let from = (offset - self.start) as usize;
        let to = (from + length).min(self.window.len());
        Ok(&self.window[from..to])
    }

    /// A copy of bytes anywhere.
    pub fn bytes(&self, offset: u64, length: usize) -> Result<Vec<u8>, RecoverError> {
        let mut bytes = vec![0; length];
        let read =
            read_at(&self.file, offset, &mut bytes).map_err(RecoverError::read(&self.path))?;
        bytes.truncate(read);
        Ok(bytes)
    }

    /// The same for a few bytes anywhere, without moving the window.
    pub fn peek<const N: usize>(&self, offset: u64) -> Result<([u8; N], usize), RecoverError> {
        let mut bytes = [0; N];
        let read = if offset < self.size {
            read_at(&self.file, offset, &mut bytes).map_err(RecoverError::read(&self.path))?
        } else {
            0
        };
        // What has been appended since is not believed.
        let known = usize::try_from(self.size.saturating_sub(offset)).unwrap_or(N);
        Ok((bytes, read.min(known)))
    }
}

fn read_at(file: &File, offset: u64, bytes: &mut [u8]) -> io::Result<usize> {
    let mut read = 0;
    while read < bytes.len() {
        match file.read_at(&mut bytes[read..], offset + read as u64) {
            Ok(0) => break,
            Ok(more) => read += more,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(read)
}
