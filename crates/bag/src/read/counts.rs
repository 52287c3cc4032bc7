//! How many messages a bag's topics have.

use std::collections::BTreeMap;

use super::BagReader;

impl BagReader {
    /// Number of messages of each topic, in the order of [`topics`](Self::topics), if all files tell; messages repeated at
    /// the head of a further file do not count.
    pub fn topic_counts(&self) -> Option<Vec<u64>> {
        let mut counts = self.counts_of_topics()?;
        let mut repeats = self.repeats();
        for (topic, count) in self.topics.iter().zip(&mut counts) {
            if let Some(left) = repeats.get_mut(&*topic.name) {
                let repeated = (*left).min(*count);
                *left -= repeated;
                *count -= repeated;
            }
        }
        Some(counts)
    }

    /// The same by the names of topics, of which one may be of several types.
    pub fn message_counts(&self) -> Option<BTreeMap<&str, u64>> {
        self.topic_counts().map(|counts| self.by_name(&counts))
    }

    /// Number of messages of each topic that are repeated at the head of a further file.
    pub fn repeats(&self) -> BTreeMap<&str, u64> {
        let mut repeats = BTreeMap::new();
        for (topic, count) in (0..self.files.len()).flat_map(|file| self.repeated_of(file)) {
            *repeats.entry(topic).or_default() += count;
        }
        repeats
    }

    pub(crate) fn repeated_of(&self, file: usize) -> impl Iterator<Item = (&str, u64)> {
        let repeated = self.files.get(file).filter(|_| file > 0);
        let repeated = repeated
            .into_iter()
            .flat_map(|file| &file.contents.repeated);
        repeated.map(|(topic, count)| (&**topic, *count))
    }

    /// Those repeated included.
    pub(crate) fn counts_of_topics(&self) -> Option<Vec<u64>> {
        let mut counts = vec![0_u64; self.topics.len()];
        for (file, topics) in self.files.iter().zip(&self.channels) {
            for (channel, count) in file.contents.counts.as_ref()? {
                if let Some(&topic) = topics.get(channel) {
                    counts[topic] = counts[topic].saturating_add(*count);
                }
            }
        }
        Some(counts)
    }

    pub(crate) fn by_name(&self, counts: &[u64]) -> BTreeMap<&str, u64> {
        let mut sums = BTreeMap::new();
        for (topic, count) in self.topics.iter().zip(counts) {
            let sum: &mut u64 = sums.entry(&*topic.name).or_default();
            *sum = sum.saturating_add(*count);
        }
        sums
    }
}
