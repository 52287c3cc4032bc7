//! Reads all of a bag, for what its files do not tell at their ends.

use super::{BagReader, file::McapFile};
use crate::{BagError, Damage};

impl BagReader {
    /// Reads every chunk and compares checksums, lengths, channels, times and the number of messages with what is said of
    /// them; what is wrong, in the order of the files.
    ///
    /// Opening a bag reads what its files tell at their ends only. A chunk without checksum is decompressed and taken apart.
    pub fn check(&self) -> Vec<BagError> {
        self.files.iter().flat_map(faults).collect()
    }
}

fn faults(file: &McapFile) -> Vec<BagError> {
    let mut faults = Vec::new();
    let mut found: u64 = 0;
    for span in &file.contents.spans {
        let read = file.read(span, 0, |_| {
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
    }
    faults
}
