//! Reads all of a bag, for what its files do not tell at their ends.

use super::{BagReader, file::McapFile};
use crate::{BagError, Damage};

impl BagReader {
    /// Reads all of every file; what is wrong, in the order of the files.
    ///
    /// Of every chunk, the checksum, length, channels, times and number of messages are compared with what is told of
    /// them. A file whose chunks are whole is then read from start to end as a stream: every record has to be
    /// readable, every checksum has to match, definitions of one id have to be equal, and all indexes, offsets and
    /// statistics have to agree with what they tell of. Opening a bag reads what its files tell at their ends only.
    pub fn check(&self) -> Vec<BagError> {
        self.files.iter().flat_map(faults).collect()
    }
}

fn faults(file: &McapFile) -> Vec<BagError> {
    let mut faults = Vec::new();
    let mut found: u64 = 0;
    let mut times: Option<(u64, u64)> = None;
    for span in &file.contents.spans {
        let read = file.read(span, 0, |header| {
            let time = header.log_time;
            let (first, last) = times.unwrap_or((time, time));
            times = Some((first.min(time), last.max(time)));
            found += 1;
            Ok(false)
        });
        faults.extend(read.err());
    }
    if let Some(counts) = &file.contents.counts {
        let expected = counts
            .values()
            .fold(0, |sum: u64, count| sum.saturating_add(*count));
        if faults.is_empty() && found != expected {
            faults.push(file.damaged(0, Damage::MessageCount { expected, found }));
        }
        if let (Some(expected), Some(found)) = (file.contents.times, times)
            && faults.is_empty()
            && found != expected
        {
            let of = "messages";
            let damage = Damage::Times {
                of,
                expected,
                found,
            };
            faults.push(file.damaged(0, damage));
        }
    }
    if faults.is_empty() && file.fault.is_none() {
        faults.extend(file.fault_of_whole());
    }
    faults
}
