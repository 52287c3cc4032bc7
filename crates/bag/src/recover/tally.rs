//! How many messages a damaged bag says it has, and how many were recovered.

use std::{collections::BTreeMap, path::Path};

use super::{original::Original, report::RecoveredFile};

/// Messages that are repeated at the head of a file are left out of the sums.
#[derive(Default)]
pub(super) struct Tally {
    /// What `metadata.yaml` says: messages of each file, and of the bag.
    files: BTreeMap<String, u64>,
    total: Option<u64>,
    /// Whether anything says how many messages there were.
    known: bool,
    /// Messages of files; as many as were recovered of those that nothing is known of.
    expected: u64,
    recovered: u64,
    /// Messages that are repeated, as the damaged files say.
    repeated: u64,
}

/// What is known of a file besides its messages.
#[derive(Default)]
pub(super) struct Told {
    /// Messages as the file's own statistics have it.
    pub messages: Option<u64>,
    /// How many of them it says are repeated.
    pub repeated: u64,
    /// How many are marked as such in the recovered file.
    pub marked: u64,
}

impl Tally {
    pub fn new(original: Option<&Original>) -> Self {
        let files = original.into_iter().flat_map(|original| &original.files);
        let name = |path: &str| Some(Path::new(path).file_name()?.to_str()?.to_owned());
        Self {
            files: files
                .filter_map(|file| Some((name(&file.path)?, file.message_count)))
                .collect(),
            total: original.and_then(|original| original.message_count),
            ..Self::default()
        }
    }

    /// Adds a file, and says how many messages it lacks.
    pub fn add(&mut self, file: &mut RecoveredFile, told: &Told) {
        let name = file.path.file_name().unwrap_or_default();
        let listed = name.to_str().and_then(|name| self.files.get(name));
        let claimed = told.messages.max(listed.copied());
        let recovered = file.messages.saturating_sub(told.marked);
        self.known |= claimed.is_some();
        self.recovered += recovered;
        self.repeated = self.repeated.saturating_add(told.repeated);
        let expected = claimed.map(|claimed| claimed.saturating_sub(told.repeated));
        self.expected = self.expected.saturating_add(expected.unwrap_or(recovered));
        file.missing = claimed.map(|claimed| claimed.saturating_sub(file.messages));
    }

    /// Messages that the bag was to have.
    pub fn expected(&self) -> Option<u64> {
        let total = self.total.map(|total| total.saturating_sub(self.repeated));
        Some(self.expected).filter(|_| self.known).max(total)
    }

    /// How many of them were not recovered.
    pub fn missing(&self) -> Option<u64> {
        let expected = self.expected()?;
        Some(expected.saturating_sub(self.recovered))
    }
}
