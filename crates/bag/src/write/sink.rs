//! The file that an MCAP writer writes to, with room reserved on the disk for what has to follow.

use std::{
    fs::File,
    io::{self, Write},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
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
    file: Arc<File>,
    written: Arc<AtomicU64>,
    failed: bool,
}

/// Space on the disk that is reserved for a file beyond its end.
///
/// A file system without `fallocate` cannot reserve any. A file on it that fills the disk has no end.
pub(crate) struct Reserve {
    file: Arc<File>,
    written: Arc<AtomicU64>,
    /// Up to where space is reserved.
    end: u64,
    /// Largest size that the process may give a file.
    limit: u64,
    is_supported: bool,
}

/// Makes the sink of a file and its reserve, which reserves nothing if it is not to.
pub(crate) fn open(file: File, reserves: bool) -> (Sink, Reserve) {
    let file = Arc::new(file);
    let written = Arc::new(AtomicU64::new(0));
    let limit = getrlimit(Resource::RLIMIT_FSIZE).map_or(u64::MAX, |(soft, _)| soft);
    let sink = Sink {
        file: file.clone(),
        written: written.clone(),
        failed: false,
    };
    let reserve = Reserve {
        file,
        written,
        end: 0,
        limit,
        is_supported: reserves,
    };
    (sink, reserve)
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.failed {
            return Err(io::Error::other("an earlier write has failed"));
        }
        match (&*self.file).write(bytes) {
            Ok(count) => {
                self.written.fetch_add(count as u64, Ordering::Relaxed);
                Ok(count)
            }
            Err(error) => {
                self.failed = error.kind() != io::ErrorKind::Interrupted;
                Err(error)
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Reserve {
    /// Number of bytes in the file.
    pub fn written(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    pub fn file(&self) -> &File {
        &self.file
    }

    /// Makes sure that so many bytes can follow those in the file.
    pub fn hold(&mut self, bytes: u64) -> io::Result<()> {
        let end = self.written() + bytes;
        if end > self.limit {
            return Err(Errno::EFBIG.into());
        }
        if end <= self.end || !self.is_supported {
            return Ok(());
        }
        self.extend(end + STEP).or_else(|_| self.extend(end))
    }

    fn extend(&mut self, end: u64) -> io::Result<()> {
        let start = self.end.max(self.written());
        let sizes = [start, end - start].map(|size| i64::try_from(size).unwrap_or(i64::MAX));
        match fallocate(
            &self.file,
            FallocateFlags::FALLOC_FL_KEEP_SIZE,
            sizes[0],
            sizes[1],
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
