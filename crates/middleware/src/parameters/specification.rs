//! What a node says of one of its parameters, and which values it accepts.

use std::{fmt, sync::Arc};

use lgvi_msgs::rcl_interfaces::{FloatingPointRange, IntegerRange, ParameterDescriptor};

use super::{
    ParameterError,
    value::{ParameterKind, ParameterType, ParameterValue},
};
use crate::yaml::NULL;

/// When a parameter may be set.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Change {
    /// Not after the start of the node.
    Never,
    /// While the node is unconfigured; it takes effect when the node is configured.
    #[default]
    Unconfigured,
    /// At any time.
    Anytime,
}

type Check = Arc<dyn Fn(&ParameterValue) -> Result<(), String> + Send + Sync>;

/// A parameter to be declared.
#[derive(Clone)]
pub struct ParameterSpec {
    pub(super) name: String,
    pub(super) kind: ParameterKind,
    default: ParameterValue,
    description: String,
    range: Option<Range>,
    constraints: String,
    check: Option<Check>,
    pub(super) change: Change,
}

#[derive(Debug, Clone, Copy)]
enum Range {
    Double { from: f64, to: f64 },
    Integer { from: i64, to: i64 },
}

impl ParameterSpec {
    /// A parameter with a default. It can be set while the node is unconfigured.
    pub fn new<T: ParameterType>(name: &str, default: T, description: &str) -> Self {
        Self {
            default: default.into(),
            ..Self::optional::<T>(name, description)
        }
    }

    /// A parameter that is not set unless it is given, and that can be unset again.
    pub fn optional<T: ParameterType>(name: &str, description: &str) -> Self {
        Self {
            name: name.into(),
            kind: T::KIND,
            default: ParameterValue::NotSet,
            description: description.into(),
            range: None,
            constraints: String::new(),
            check: None,
            change: Change::default(),
        }
    }

    /// The least and the greatest value of a floating-point parameter. NaN is in no range.
    #[must_use]
    pub fn range(self, from: f64, to: f64) -> Self {
        Self {
            range: Some(Range::Double { from, to }),
            ..self
        }
    }

    /// The least and the greatest value of an integer parameter.
    #[must_use]
    pub fn integer_range(self, from: i64, to: i64) -> Self {
        Self {
            range: Some(Range::Integer { from, to }),
            ..self
        }
    }

    /// What else is demanded of values, in words.
    #[must_use]
    pub fn constraints(self, text: &str) -> Self {
        Self {
            constraints: text.into(),
            ..self
        }
    }

    /// Asks `check` about every value of the right type and in range, the default included; it answers with what it
    /// expects.
    #[must_use]
    pub fn check(
        self,
        check: impl Fn(&ParameterValue) -> Result<(), String> + Send + Sync + 'static,
    ) -> Self {
        Self {
            check: Some(Arc::new(check)),
            ..self
        }
    }

    /// When the parameter may be set: while the node is unconfigured, unless this says otherwise.
    #[must_use]
    pub fn change(self, when: Change) -> Self {
        Self {
            change: when,
            ..self
        }
    }

    /// The name, and the default and the description for a person.
    pub fn help(&self) -> (&str, String) {
        let range = self
            .range
            .map_or_else(String::new, |range| format!(", {range}"));
        let constraints = match self.constraints.as_str() {
            "" => String::new(),
            text => format!("; {text}"),
        };
        let Self {
            description,
            default,
            ..
        } = self;
        (
            &self.name,
            format!("{description} (default: {default}{range}{constraints})"),
        )
    }

    /// The value to begin with: the one given, or the default.
    pub(super) fn begin(
        &self,
        given: Option<ParameterValue>,
    ) -> Result<ParameterValue, ParameterError> {
        match (self.range, self.kind) {
            (None, _)
            | (Some(Range::Double { .. }), ParameterKind::Double)
            | (Some(Range::Integer { .. }), ParameterKind::Integer) => {}
            _ => return Err(self.wrong("its range is not of its type")),
        }
        let default = self.accept(self.default.clone());
        let default = default.map_err(|error| self.wrong(&error.to_string()))?;
        match given {
            None => Ok(default),
            // As a dump of the parameters has it.
            Some(ParameterValue::NotSet) if default == ParameterValue::NotSet => Ok(default),
            Some(ParameterValue::NotSet) if self.kind == ParameterKind::String => {
                self.accept(NULL.into())
            }
            Some(ParameterValue::NotSet) => {
                Err(ParameterError::not_of(self.kind, &self.name, NULL))
            }
            Some(value) => self.accept(value),
        }
    }

    /// The value as one of the parameter's type, if it is acceptable.
    pub(super) fn accept(&self, value: ParameterValue) -> Result<ParameterValue, ParameterError> {
        if value == ParameterValue::NotSet && self.default == ParameterValue::NotSet {
            return Ok(value);
        }
        let text = value.to_string();
        let value = self
            .kind
            .accept(value)
            .ok_or_else(|| ParameterError::not_of(self.kind, &self.name, text))?;
        let accepted = match self.range {
            Some(range) if !range.contains(&value) => {
                Err(format!("expected {} {range}", self.kind.expected()))
            }
            _ => self.check.as_ref().map_or(Ok(()), |check| check(&value)),
        };
        match accepted {
            Ok(()) => Ok(value),
            Err(reason) => Err(ParameterError::Refused {
                name: self.name.clone(),
                value: value.to_string(),
                reason,
            }),
        }
    }

    pub(super) fn descriptor(&self) -> ParameterDescriptor {
        let mut descriptor = ParameterDescriptor {
            name: self.name.clone(),
            r#type: self.kind.number(),
            description: self.description.clone(),
            additional_constraints: self.constraints.clone(),
            read_only: self.change == Change::Never,
            ..Default::default()
        };
        if self.change == Change::Unconfigured {
            if !self.constraints.is_empty() {
                descriptor.additional_constraints += "; ";
            }
            descriptor.additional_constraints += "set it while the node is unconfigured";
        }
        match self.range {
            None => {}
            Some(Range::Double { from, to }) => {
                descriptor.floating_point_range = vec![FloatingPointRange {
                    from_value: from,
                    to_value: to,
                    step: 0.0,
                }];
            }
            Some(Range::Integer { from, to }) => {
                descriptor.integer_range = vec![IntegerRange {
                    from_value: from,
                    to_value: to,
                    step: 0,
                }];
            }
        }
        descriptor
    }

    pub(super) fn wrong(&self, reason: &str) -> ParameterError {
        ParameterError::Declaration {
            name: self.name.clone(),
            reason: reason.into(),
        }
    }
}

impl Range {
    fn contains(self, value: &ParameterValue) -> bool {
        match (self, value) {
            (Self::Double { from, to }, ParameterValue::Double(value)) => {
                (from..=to).contains(value)
            }
            (Self::Integer { from, to }, ParameterValue::Integer(value)) => {
                (from..=to).contains(value)
            }
            _ => false,
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Double { from, to: f64::MAX } => write!(f, "at least {from:?}"),
            Self::Double { from, to } => write!(f, "from {from:?} to {to:?}"),
            Self::Integer { from, to: i64::MAX } => write!(f, "at least {from}"),
            Self::Integer { from, to } => write!(f, "from {from} to {to}"),
        }
    }
}
