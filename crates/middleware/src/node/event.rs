use serde::{Deserialize, Serialize};

/// An event of a node's life, reported to the process that started it.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The node is ready for work: active, or configured where somebody else manages it.
    Ready,
    /// The node ends with an error.
    Failed {
        /// The error.
        message: String,
    },
}
