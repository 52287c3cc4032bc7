use std::collections::BTreeMap;
use std::ops::Range;

use crate::Row;

/// The samples that a thread flies at a time, and the index of their part.
pub(crate) struct Unit {
    pub(crate) part: usize,
    pub(crate) samples: Range<u64>,
}

/// The samples to be flown, and the rows of parts that are not complete.
pub(crate) struct Queue<'a> {
    parts: &'a [Range<u64>],
    /// Number of samples of a unit.
    unit: u64,
    /// Index of the part of the next unit.
    part: usize,
    /// Number of samples of this part that have been taken.
    taken: u64,
    ended: bool,
    begun: BTreeMap<usize, Vec<Row>>,
}

impl<'a> Queue<'a> {
    /// Creates the queue of these parts, which have at most `size` samples.
    pub(crate) fn new(parts: &'a [Range<u64>], size: u64) -> Self {
        Self {
            parts,
            // A few registers of lanes; one where samples are dear, so that several threads share a part.
            unit: (size / 4).clamp(8, 32),
            part: 0,
            taken: 0,
            ended: false,
            begun: BTreeMap::new(),
        }
    }

    /// Begins no further parts.
    pub(crate) fn end(&mut self) {
        self.ended = true;
    }

    /// Takes the next unit.
    pub(crate) fn take(&mut self) -> Option<Unit> {
        if self.ended && self.taken == 0 {
            return None;
        }
        let part = self.part;
        let Range { start, end } = self.parts.get(part)?.clone();
        let first = start + self.taken;
        let samples = first..end.min(first + self.unit);
        self.taken = samples.end - start;
        if samples.end == end {
            (self.part, self.taken) = (part + 1, 0);
        }
        Some(Unit { part, samples })
    }

    /// Adds rows to a part. Returns its rows in order if they are complete.
    pub(crate) fn add(&mut self, part: usize, rows: Vec<Row>) -> Option<Vec<Row>> {
        let of_part = self.begun.entry(part).or_default();
        of_part.extend(rows);
        let Range { start, end } = self.parts[part];
        if (of_part.len() as u64) < end - start {
            return None;
        }
        let mut rows = self.begun.remove(&part)?;
        rows.sort_by_key(|row| row.index);
        Some(rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(index: u64) -> Row {
        Row {
            index,
            steps: 0,
            failure: None,
            numbers: Vec::new(),
        }
    }

    #[test]
    fn parts_that_were_begun_become_complete_after_the_end() {
        let parts = [5..40, 64..70];
        let mut queue = Queue::new(&parts, 32);
        let first = queue.take().unwrap();
        assert_eq!((first.part, first.samples), (0, 5..13));
        queue.end();
        let rest: Vec<_> = std::iter::from_fn(|| queue.take()).collect();
        let samples: Vec<_> = rest.iter().map(|unit| unit.samples.clone()).collect();
        assert_eq!(samples, [13..21, 21..29, 29..37, 37..40]);
        for unit in rest.into_iter().rev() {
            assert_eq!(queue.add(0, unit.samples.map(row).collect()), None);
        }
        let whole = queue.add(0, (5..13).map(row).collect()).unwrap();
        assert!(whole.iter().map(|row| row.index).eq(5..40));
    }

    #[test]
    fn all_samples_are_taken_once() {
        let parts = [0..1024, 2048..2049, 3072..3104];
        for (size, unit) in [(1024, 32), (64, 16), (32, 8)] {
            let mut queue = Queue::new(&parts, size);
            let units: Vec<_> = std::iter::from_fn(|| queue.take()).collect();
            assert_eq!(units[0].samples, 0..unit);
            let taken = units.into_iter().flat_map(|unit| unit.samples);
            assert!(taken.eq((0..1024).chain(2048..2049).chain(3072..3104)));
        }
    }
}
