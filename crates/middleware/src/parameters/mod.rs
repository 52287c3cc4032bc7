//! Parameters of a node, as a ROS 2 user expects them: declared with descriptors, given on the command line and in
//! parameter files, validated before they take effect, seen and set through services.

#[cfg(feature = "transport")]
mod services;
mod specification;
mod store;
#[cfg(test)]
mod tests;
mod value;

pub use specification::{Change, ParameterSpec};
pub use store::Parameters;
pub use value::{ParameterKind, ParameterType, ParameterValue};

use std::collections::BTreeMap;

use lgvi_msgs::excerpt;

/// The parameters given to one node on the command line and in parameter files, before it has declared its own.
pub type Given = BTreeMap<String, ParameterValue>;

/// A parameter that is not known, or whose value is not accepted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParameterError {
    /// The value is of another type than the parameter, outside of its range, or refused by its own check.
    #[error("parameter {:?} is {}; {reason}", excerpt(name), excerpt(value))]
    Refused {
        /// The parameter.
        name: String,
        /// The value.
        value: String,
        /// What is expected instead.
        reason: String,
    },
    /// A parameter was given that the node does not have.
    #[error("unknown parameter {:?}; this node has {}", excerpt(name), known.join(", "))]
    Unknown {
        /// The parameter.
        name: String,
        /// The parameters that the node has.
        known: Vec<String>,
    },
    /// A parameter is asked for or set that was not declared.
    #[error("parameter {:?} is not declared; this node has {}", excerpt(name), known.join(", "))]
    NotDeclared {
        /// The parameter.
        name: String,
        /// The parameters that the node has.
        known: Vec<String>,
    },
    /// A parameter without a default was not given.
    #[error("parameter {name:?} is not set; expected {expected}")]
    NotSet {
        /// The parameter.
        name: String,
        /// The parameter's type.
        expected: &'static str,
    },
    /// The parameter cannot change after the start of the node.
    #[error(
        "parameter {name:?} cannot be set to {}; it is read-only after the start of the node",
        excerpt(&value.to_string())
    )]
    ReadOnly {
        /// The parameter.
        name: String,
        /// The value.
        value: ParameterValue,
    },
    /// The parameter cannot change now.
    #[error(
        "parameter {name:?} cannot be set to {} now; it can while the node is unconfigured",
        excerpt(&value.to_string())
    )]
    Configured {
        /// The parameter.
        name: String,
        /// The value.
        value: ParameterValue,
    },
    /// The declaration contradicts itself.
    #[error("parameter {name:?} is declared wrongly: {reason}")]
    Declaration {
        /// The parameter.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
}

impl ParameterError {
    fn not_of(kind: ParameterKind, name: &str, value: impl ToString) -> Self {
        Self::Refused {
            name: name.into(),
            value: value.to_string(),
            reason: format!("expected {}", kind.expected()),
        }
    }
}
