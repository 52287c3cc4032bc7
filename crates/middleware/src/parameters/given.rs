//! The parameters given on the command line and in parameter files.

use std::collections::BTreeMap;

use serde_yaml_ng::Value;

/// The parameters given to one node, before it has declared its own.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Given(BTreeMap<String, Value>);

impl Given {
    /// Collects parameters; of two with the same name the later wins.
    pub(crate) fn new(given: impl IntoIterator<Item = (String, Value)>) -> Self {
        Self(given.into_iter().collect())
    }

    pub(super) fn into_values(self) -> BTreeMap<String, Value> {
        self.0
    }

    #[cfg(test)]
    pub(crate) fn value(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }
}

pub(super) fn yaml_text(value: &Value) -> String {
    serde_yaml_ng::to_string(value).map_or_else(|_| format!("{value:?}"), |text| text.trim().into())
}
