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

/// Bytes that are reserved ahead where the disk has them.
const STEP: u64 = 1 << 20;
/// The least that is reserved ahead. Where the disk has not even that, only what is needed is reserved.
const SMALL_STEP: u64 = 4 << 10;

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
    /// Bytes to be reserved at once.
    step: u64,
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
            step: STEP,
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
        self.step = reserve(self.step, |ahead| self.extend(start, end + ahead))?;
        Ok(())
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

/// Reserves `step` bytes ahead, or less where that fails, and gives the step to try the next time: on a disk that is nearly
/// full a file system may take and give back page after page before it finds out that it has too few.
fn reserve(mut step: u64, mut extend: impl FnMut(u64) -> io::Result<()>) -> io::Result<u64> {
    while step >= SMALL_STEP {
        if extend(step).is_ok() {
            return Ok(STEP.min(2 * step));
        }
        step /= 2;
    }
    extend(0).map(|()| SMALL_STEP)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disk_is_filled_to_its_last_byte_with_few_attempts() {
        for (disk, message) in [(2 << 20, 100), (10 << 20, 5000), (3 << 20, 2 << 20)] {
            let (mut reserved, mut needed, mut step) = (0, 0, STEP);
            let (mut attempts, mut bytes_tried) = (0, 0);
            loop {
                let end = needed + message;
                if end > reserved {
                    let extended = reserve(step, |ahead| {
                        attempts += 1;
                        bytes_tried += end + ahead - reserved;
                        if end + ahead > disk {
                            return Err(ErrorKind::StorageFull.into());
                        }
                        reserved = end + ahead;
                        Ok(())
                    });
                    match extended {
                        Ok(next) => step = next,
                        Err(_) => break,
                    }
                }
                needed = end;
            }
            assert!(disk - needed < message, "{needed} of {disk} bytes");
            // The last page is reserved message by message.
            assert!(
                attempts <= 60 + 2 * (SMALL_STEP / message),
                "{attempts} attempts"
            );
            assert!(bytes_tried < 6 * disk, "{bytes_tried} bytes for {disk}");
        }
    }
}
