//! The parameters given on the command line and in parameter files.

use std::collections::BTreeMap;

use super::ParameterValue;

/// The parameters given to one node, before it has declared its own.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Given(BTreeMap<String, ParameterValue>);

impl Given {
    /// Collects parameters; of two with the same name the later wins.
    pub(crate) fn new(given: impl IntoIterator<Item = (String, ParameterValue)>) -> Self {
        Self(given.into_iter().collect())
    }

    pub(super) fn into_values(self) -> BTreeMap<String, ParameterValue> {
        self.0
    }

    #[cfg(test)]
    pub(crate) fn value(&self, name: &str) -> Option<&ParameterValue> {
        self.0.get(name)
    }
}
