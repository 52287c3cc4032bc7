//! Counts by group and kernel, and the file that keeps them.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::GuardError;

/// What stands at the top of the file.
const HEADER: &str = "# Instructions of the hot kernels by callgrind, see src/kernels. `just instructions-update` writes this.\n";

/// Instruction counts, and the compiler that they belong to.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Counts {
    /// Version and target of rustc.
    pub toolchain: String,
    pub instructions: BTreeMap<String, BTreeMap<String, u64>>,
}

impl Counts {
    pub(crate) fn read(path: &Path) -> Result<Self, GuardError> {
        let text = std::fs::read_to_string(path).map_err(|source| GuardError::File {
            path: path.into(),
            source,
        })?;
        toml::from_str(&text).map_err(|error| GuardError::form(path, error))
    }

    pub(crate) fn write(&self, path: &Path) -> Result<(), GuardError> {
        let text = toml::to_string(self).map_err(|error| GuardError::form(path, error))?;
        std::fs::write(path, format!("{HEADER}{text}")).map_err(|source| GuardError::File {
            path: path.into(),
            source,
        })
    }

    /// Number of kernels.
    pub(crate) fn len(&self) -> usize {
        self.instructions.values().map(BTreeMap::len).sum()
    }

    pub(crate) fn get(&self, group: &str, kernel: &str) -> Option<u64> {
        self.instructions.get(group)?.get(kernel).copied()
    }

    /// Group, kernel and count.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&str, &str, u64)> {
        self.instructions.iter().flat_map(|(group, kernels)| {
            kernels
                .iter()
                .map(move |(kernel, &count)| (group.as_str(), kernel.as_str(), count))
        })
    }
}
