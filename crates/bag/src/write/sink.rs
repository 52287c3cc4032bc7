//! The file that an MCAP writer writes to, with room reserved on the disk for what has to follow.

use std::{
    fs::File,
    io::{self, ErrorKind, Write},
    sync::Arc,
};

use nix::{
    errno::Errno,
    fcntl::{FallocateFlags, fallocate},
    sys::resource::{Resource, getrlimit},
};

/// Bytes that are reserved at once, where the disk has them.
const STEP: u64 = 1 << 20;

/// Writes to a file until the first error, after which all that follows fails too: the file then has no gaps.
pub(crate) struct Sink {
    pub file: Arc<File>,
    pub failed: bool,
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.failed {
            return Err(io::Error::other("an earlier write has failed"));
        }
        let written = (&*self.file).write(bytes);
        let error = written.as_ref().err();
        self.failed = error.is_some_and(|error| error.kind() != ErrorKind::Interrupted);
        written
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Space on the disk that is reserved for a file beyond its end.
///
/// A file system without `fallocate` cannot reserve any. A file on it that fills the disk has no end.
pub(crate) struct Reserve {
    pub file: Arc<File>,
    /// Up to where space is reserved.
    end: u64,
    /// Largest size that the process may give a file.
    limit: u64,
    is_supported: bool,
}

impl Reserve {
    /// For a file without contents; it reserves nothing if it is not to.
    pub fn new(file: File, reserves: bool) -> Self {
        Self {
            file: Arc::new(file),
            end: 0,
            limit: getrlimit(Resource::RLIMIT_FSIZE).map_or(u64::MAX, |(soft, _)| soft),
            is_supported: reserves,
        }
    }

    /// Makes sure that so many bytes can follow the first ones.
    pub fn hold(&mut self, written: u64, bytes: u64) -> io::Result<()> {
        let end = written + bytes;
        if end > self.limit {
            return Err(Errno::EFBIG.into());
        }
        if end <= self.end || !self.is_supported {
            return Ok(());
        }
        let start = self.end.max(written);
        self.extend(start, end + STEP)
            .or_else(|_| self.extend(start, end))
    }

    fn extend(&mut self, start: u64, end: u64) -> io::Result<()> {
        let [start, length] =
            [start, end - start].map(|size| i64::try_from(size).unwrap_or(i64::MAX));
        match fallocate(
            &self.file,
            FallocateFlags::FALLOC_FL_KEEP_SIZE,
            start,
            length,
        ) {
            Ok(()) => self.end = end,
            Err(Errno::ENOSYS | Errno::EOPNOTSUPP | Errno::EINVAL) => self.is_supported = false,
            Err(error) => return Err(error.into()),
        }
        Ok(())
    }

    /// Cuts the file to a length and gives back what is reserved behind it.
    pub fn release(&mut self, length: u64) -> io::Result<()> {
        self.end = 0;
        self.file.set_len(length)
    }
}
