//! Room in the file system of shared memory.
//!
//! Segments are sparse files: a page that there is no room for ends the process by SIGBUS when it is first written to. So room is
//! looked for, or reserved, beforehand.

use std::{
    fs::{self, File},
    ops::Range,
};

use nix::{
    errno::Errno,
    fcntl::{FallocateFlags, fallocate},
    sys::statvfs::statvfs,
};

use super::ShmError;

/// Where POSIX shared memory lies.
const DIRECTORY: &str = "/dev/shm";

/// What a service and the connections of its ports may take beside samples (byte).
const OVERHEAD: u64 = 8 << 20;

/// How much more than needed is reserved at a time (byte).
const BLOCK: usize = 1 << 20;

/// Whether there is room for a service, its ports, and `samples` bytes of samples. What is found is not reserved.
pub(super) fn check(service: &str, samples: usize) -> Result<(), ShmError> {
    let needed = OVERHEAD.saturating_add(samples as u64);
    match free() {
        Some(free) if free < needed => Err(full(service, needed, free)),
        _ => Ok(()),
    }
}

/// Free room (byte); `None` where that is not known.
fn free() -> Option<u64> {
    let system = statvfs(DIRECTORY).ok()?;
    let blocks: u64 = system.blocks_available();
    Some(blocks.saturating_mul(system.fragment_size()))
}

fn full(service: &str, needed: u64, free: u64) -> ShmError {
    ShmError::Full {
        service: service.to_owned(),
        path: DIRECTORY.to_owned(),
        needed,
        free,
    }
}

/// The segment that a publisher's samples lie in, as far as it has its room.
#[derive(Debug, Default)]
pub(super) struct Reserved {
    segment: Option<Segment>,
}

/// A mapped file of shared memory. iceoryx2 takes memory for the first time in ascending order.
#[derive(Debug)]
struct Segment {
    addresses: Range<usize>,
    /// Up to which address there is room.
    reserved: usize,
    /// Where in the file the addresses begin.
    offset: usize,
    /// `None` where the file is not known: it is taken to have its room.
    file: Option<File>,
}

impl Reserved {
    /// Reserves room for a sample with these addresses, and for the next one, whose header is written as soon as it is loaned.
    pub(super) fn cover(&mut self, service: &str, sample: &Range<usize>) -> Result<(), ShmError> {
        let known = self.segment.take().filter(|segment| segment.has(sample));
        let segment = self.segment.insert(known.unwrap_or_else(|| {
            Segment::of(sample).unwrap_or(Segment {
                addresses: 0..usize::MAX,
                reserved: usize::MAX,
                offset: 0,
                file: None,
            })
        }));
        let next = sample.end + sample.len();
        segment
            .reserve(next)
            .map_err(|needed| full(service, needed as u64, free().unwrap_or(0)))
    }
}

impl Segment {
    fn of(sample: &Range<usize>) -> Option<Self> {
        let maps = fs::read_to_string("/proc/self/maps").ok()?;
        let mut segments = maps.lines().filter_map(Self::parse);
        segments.find(|segment| segment.has(sample))
    }

    /// Of a line such as `7f0000000000-7f0000100000 rw-s 00000000 00:1a 42    /dev/shm/name`.
    fn parse(line: &str) -> Option<Self> {
        let path = &line[line.find(DIRECTORY)?..];
        let hexadecimal = |text| usize::from_str_radix(text, 16).ok();
        let mut fields = line.split_whitespace();
        let (start, end) = fields.next()?.split_once('-')?;
        let start = hexadecimal(start)?;
        Some(Self {
            addresses: start..hexadecimal(end)?,
            reserved: start,
            offset: hexadecimal(fields.nth(1)?)?,
            file: File::options().write(true).open(path).ok(),
        })
    }

    fn has(&self, sample: &Range<usize>) -> bool {
        self.addresses.start <= sample.start && sample.end <= self.addresses.end
    }

    /// Reserves room up to `end`, or returns how many bytes are lacking for it.
    fn reserve(&mut self, end: usize) -> Result<(), usize> {
        let end = end.min(self.addresses.end);
        if end <= self.reserved {
            return Ok(());
        }
        let ample = end.saturating_add(BLOCK).min(self.addresses.end);
        for end in [ample, end] {
            match self.allocate(end) {
                Err(Errno::ENOSPC) => {}
                // A file system that cannot reserve is not asked again.
                _ => {
                    self.reserved = end;
                    return Ok(());
                }
            }
        }
        Err(end - self.reserved)
    }

    fn allocate(&self, end: usize) -> Result<(), Errno> {
        let Some(file) = &self.file else {
            return Ok(());
        };
        let offset = self.offset + (self.reserved - self.addresses.start);
        let [offset, length] = [offset, end - self.reserved]
            .map(|value| i64::try_from(value).map_err(|_| Errno::EFBIG));
        let (offset, length) = (offset?, length?);
        loop {
            match fallocate(file, FallocateFlags::FALLOC_FL_KEEP_SIZE, offset, length) {
                Err(Errno::EINTR) => {}
                done => return done,
            }
        }
    }
}
