//! How many messages a damaged bag says it has, and how many were recovered.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{original::Original, report::RecoveredFile};
use crate::metadata::within;

/// Messages that are repeated at the head of a file are left out of the sums.
#[derive(Default)]
pub(super) struct Tally {
    /// What `metadata.yaml` or other files say: messages of each file, and of the bag.
    files: BTreeMap<PathBuf, u64>,
    total: Option<u64>,
    /// Whether anything says how many messages there were.
    known: bool,
    /// Messages of files; as many as were recovered of those that nothing is known of.
    expected: u64,
    recovered: u64,
    /// Messages that are repeated, as the damaged files say.
    repeated: u64,
    /// Files of which nothing is left that says what they repeat.
    silent: Vec<Silent>,
    /// Whether files of this bag repeat latched messages at all.
    repeats: bool,
}

/// A file of which nothing is left but its number of messages.
struct Silent {
    messages: u64,
    /// The latched topics that the bag had before it.
    latched: BTreeMap<String, LatchedTopic>,
}

/// What is known of a latched topic.
#[derive(Clone, Copy)]
pub(super) struct LatchedTopic {
    /// Its messages so far.
    pub messages: u64,
    /// How many of them are kept.
    pub depth: u64,
}

/// What is known of a file besides its messages.
#[derive(Default)]
pub(super) struct Told {
    /// Messages as the file's own statistics have it.
    pub messages: Option<u64>,
    /// How many of them it says are repeated, by topic.
    pub repeated: Option<BTreeMap<String, u64>>,
    /// How many are marked as such in the recovered file.
    pub marked: u64,
    /// Whether it was made by what repeats latched messages.
    pub repeats: bool,
}

impl Tally {
    pub fn new(original: Option<&Original>, told: BTreeMap<PathBuf, u64>) -> Self {
        let mut files = told;
        if let Some(original) = original {
            files.extend(original.files.iter().filter_map(|file| {
                Some((within(&file.path, original.version)?, file.message_count))
            }));
        }
        Self {
            files,
            total: original.and_then(|original| original.message_count),
            ..Self::default()
        }
    }

    /// Adds a file, and says how many messages it lacks. `latched` are the topics of the files before it.
    pub fn add(
        &mut self,
        name: &Path,
        file: &mut RecoveredFile,
        told: &Told,
        latched: impl FnOnce() -> BTreeMap<String, LatchedTopic>,
    ) {
        self.repeats |= told.repeats;
        let claimed = told.messages.max(self.files.get(name).copied());
        file.missing = claimed.map(|claimed| claimed.saturating_sub(file.messages));
        self.known |= claimed.is_some();
        let recovered = file.messages.saturating_sub(told.marked);
        self.recovered += recovered;
        if let Some(repeated) = &told.repeated {
            self.settle(repeated);
        }
        match claimed {
            Some(messages) if file.messages == 0 && told.repeated.is_none() => {
                let latched = latched();
                self.silent.push(Silent { messages, latched });
            }
            _ => {
                let repeated = told.repeated.iter().flat_map(BTreeMap::values);
                let repeated = repeated.fold(0, |sum: u64, count| sum.saturating_add(*count));
                self.repeated = self.repeated.saturating_add(repeated);
                let expected = claimed.map(|claimed| claimed.saturating_sub(repeated));
                self.expected = self.expected.saturating_add(expected.unwrap_or(recovered));
            }
        }
    }

    /// Files of which nothing is left have repeated what the next one repeats, as far as it is from before them.
    fn settle(&mut self, next: &BTreeMap<String, u64>) {
        for silent in std::mem::take(&mut self.silent) {
            let before = |topic| {
                silent
                    .latched
                    .get(topic)
                    .map_or(0, |before| before.messages)
            };
            let repeated = next.iter().map(|(topic, count)| before(topic).min(*count));
            let repeated = repeated.fold(0, u64::saturating_add);
            self.repeated = self.repeated.saturating_add(repeated);
            let messages = silent.messages.saturating_sub(repeated);
            self.expected = self.expected.saturating_add(messages);
        }
    }

    /// Messages of the files of which nothing is left and that no other follows, and how many of them they repeated: of
    /// each latched topic as many as are kept.
    fn last(&self) -> (u64, u64) {
        self.silent.iter().fold((0, 0), |(messages, sum), silent| {
            let latched = silent.latched.values().filter(|_| self.repeats);
            let kept = latched.map(|topic| topic.messages.min(topic.depth));
            let repeated = kept.fold(0, u64::saturating_add).min(silent.messages);
            (
                silent.messages.saturating_add(messages),
                repeated.saturating_add(sum),
            )
        })
    }

    /// Messages that the bag was to have.
    pub fn expected(&self) -> Option<u64> {
        let (messages, repeated) = self.last();
        let expected = self
            .expected
            .saturating_add(messages - repeated.min(messages));
        let all_repeated = self.repeated.saturating_add(repeated);
        let total = self.total.map(|total| total.saturating_sub(all_repeated));
        Some(expected).filter(|_| self.known).max(total)
    }

    /// How many of them were not recovered.
    pub fn missing(&self) -> Option<u64> {
        let expected = self.expected()?;
        Some(expected.saturating_sub(self.recovered))
    }
}
