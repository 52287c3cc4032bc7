//! Which samples have been received already, on whichever subscription.

use std::collections::BTreeMap;

use lgvi_middleware::ros::WriterId;

/// The samples seen of each publisher, as ranges of sequence numbers: the first of each range and its last.
#[derive(Debug, Default)]
pub(crate) struct Seen(BTreeMap<WriterId, BTreeMap<u64, u64>>);

impl Seen {
    /// Takes note of a sample; whether it is new. Any order will do.
    pub(crate) fn insert(&mut self, writer: WriterId, sequence: u64) -> bool {
        let ranges = self.0.entry(writer).or_default();
        let before = ranges.range(..=sequence).next_back();
        let (mut first, mut last) = (sequence, sequence);
        match before.map(|(first, last)| (*first, *last)) {
            Some((_, end)) if end >= sequence => return false,
            Some((start, end)) if end + 1 == sequence => first = start,
            _ => {}
        }
        if let Some(end) = ranges.remove(&sequence.saturating_add(1)) {
            last = end;
        }
        ranges.insert(first, last);
        true
    }

    /// Samples between the first and the last of their publisher that have not been seen.
    pub(crate) fn missing(&self) -> u64 {
        let gaps = |ranges: &BTreeMap<u64, u64>| -> u64 {
            let starts = ranges.keys().skip(1);
            ranges
                .values()
                .zip(starts)
                .map(|(end, start)| start - end - 1)
                .sum()
        };
        self.0.values().map(gaps).sum()
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
        assert_eq!(seen.0[&ONE], BTreeMap::from([(1, 10)]));
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
    }
}
