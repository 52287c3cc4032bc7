//! Which samples have been received already, on whichever subscription.

use std::collections::BTreeMap;

use lgvi_middleware::ros::WriterId;

/// The most ranges that are kept of a publisher: the oldest gaps beyond them stay missing.
const RANGES: usize = 1024;

/// The most publishers that are kept: of one that has sent nothing for longest the gaps alone are.
const WRITERS: usize = 1024;

/// The samples seen of each publisher.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    writers: BTreeMap<WriterId, Ranges>,
    /// Samples missing of publishers that are not kept any more.
    forgotten: u64,
    /// Counts the samples.
    time: u64,
}

/// The samples seen of a publisher, as ranges of sequence numbers: the first of each range and its last.
#[derive(Debug, Default)]
struct Ranges {
    ranges: BTreeMap<u64, u64>,
    /// Missing in gaps that are kept.
    gaps: u64,
    /// Missing in gaps that are not.
    closed: u64,
    /// When its last sample came.
    latest: u64,
}

impl Seen {
    /// Takes note of a sample; whether it is new. Any order will do.
    pub(crate) fn insert(&mut self, writer: WriterId, sequence: u64) -> bool {
        self.time += 1;
        if !self.writers.contains_key(&writer) && self.writers.len() >= WRITERS {
            self.forget_one();
        }
        let ranges = self.writers.entry(writer).or_default();
        ranges.latest = self.time;
        ranges.insert(sequence)
    }

    /// Samples between the first and the last of their publisher that have not been seen.
    pub(crate) fn missing(&self) -> u64 {
        let kept = self.writers.values().map(Ranges::missing);
        kept.fold(self.forgotten, u64::saturating_add)
    }

    fn forget_one(&mut self) {
        let oldest = self.writers.iter().min_by_key(|(_, ranges)| ranges.latest);
        if let Some(writer) = oldest.map(|(writer, _)| *writer)
            && let Some(ranges) = self.writers.remove(&writer)
        {
            self.forgotten = self.forgotten.saturating_add(ranges.missing());
        }
    }
}

impl Ranges {
    fn insert(&mut self, sequence: u64) -> bool {
        let before = self.ranges.range(..=sequence).next_back();
        let before = before.map(|(first, last)| (*first, *last));
        if before.is_some_and(|(_, last)| last >= sequence) {
            return false;
        }
        let after = self.ranges.range(sequence..).next();
        let after = after.map(|(first, last)| (*first, *last));
        // What has been given up as missing stays so.
        if before.is_none() && self.closed > 0 {
            return false;
        }
        match (before, after) {
            (Some(_), Some(_)) => self.gaps -= 1,
            (Some((_, last)), None) => self.gaps += sequence - last - 1,
            (None, Some((first, _))) => self.gaps += first - sequence - 1,
            (None, None) => {}
        }
        let mut range = (sequence, sequence);
        if let Some((first, last)) = after.filter(|(first, _)| *first == sequence + 1) {
            self.ranges.remove(&first);
            range.1 = last;
        }
        if let Some((first, _)) = before.filter(|(_, last)| last + 1 == sequence) {
            range.0 = first;
        }
        self.ranges.insert(range.0, range.1);
        if self.ranges.len() > RANGES {
            self.close_one();
        }
        true
    }

    /// Gives up the oldest gap.
    fn close_one(&mut self) {
        if let Some((_, last)) = self.ranges.pop_first()
            && let Some((next, _)) = self.ranges.first_key_value()
        {
            let gap = next - last - 1;
            self.gaps -= gap;
            self.closed += gap;
        }
    }

    fn missing(&self) -> u64 {
        self.gaps + self.closed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: WriterId = WriterId([1; 16]);
    const OTHER: WriterId = WriterId([2; 16]);

    #[test]
    fn every_sample_is_new_once_in_any_order() {
        let mut seen = Seen::default();
        // What comes late is new, though later ones have come: history on one subscription, the present on another.
        let order = [7, 8, 1, 2, 7, 3, 8, 9, 5, 4, 6, 5, 10, 1];
        let new: Vec<u64> = order
            .into_iter()
            .filter(|sequence| seen.insert(ONE, *sequence))
            .collect();
        assert_eq!(new, [7, 8, 1, 2, 3, 9, 5, 4, 6, 10]);
        assert_eq!(seen.writers[&ONE].ranges, BTreeMap::from([(1, 10)]));
        assert_eq!(seen.missing(), 0);
        assert!(seen.insert(OTHER, 1), "publishers count for themselves");
    }

    #[test]
    fn gaps_are_missing_until_they_are_filled() {
        let mut seen = Seen::default();
        for sequence in [5, 6, 9, 12] {
            seen.insert(ONE, sequence);
        }
        seen.insert(OTHER, 100);
        assert_eq!(seen.missing(), 4);
        seen.insert(ONE, 10);
        assert_eq!(seen.missing(), 3);
        seen.insert(ONE, 2);
        assert_eq!(seen.missing(), 5);
    }

    #[test]
    fn memory_is_bounded_and_what_is_missing_stays_so() {
        let mut seen = Seen::default();
        let count = 3 * RANGES as u64;
        for sequence in 0..count {
            assert!(seen.insert(ONE, 2 * sequence));
        }
        assert_eq!(seen.writers[&ONE].ranges.len(), RANGES);
        assert_eq!(seen.missing(), count - 1);
        assert!(!seen.insert(ONE, 1), "given up");
        assert!(seen.insert(ONE, 2 * count - 3));
        assert_eq!(seen.missing(), count - 2);

        for index in 0..2 * WRITERS as u64 {
            let mut id = [0; 16];
            id[..8].copy_from_slice(&index.to_le_bytes());
            seen.insert(WriterId(id), 1);
            seen.insert(WriterId(id), 3);
        }
        assert_eq!(seen.writers.len(), WRITERS);
        assert_eq!(seen.missing(), count - 2 + 2 * WRITERS as u64);
    }
}
