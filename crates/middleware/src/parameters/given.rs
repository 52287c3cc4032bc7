//! The parameters given on the command line and in parameter files.

use std::{collections::BTreeMap, path::PathBuf};

use serde_yaml_ng::Value;

use super::ParameterError;

/// Parameters every ROS 2 node accepts, whether it declares them or not.
const ALWAYS_ALLOWED: [&str; 2] = ["use_sim_time", "start_type_description_service"];
const ALWAYS_ALLOWED_PREFIX: &str = "qos_overrides.";

/// A type a parameter can be read as.
pub trait FromParameter: Sized {
    /// What is expected, as it is said to the user.
    const EXPECTED: &'static str;

    /// Reads the YAML value; `None` if it is of another type.
    fn from_parameter(value: &Value) -> Option<Self>;
}

/// The parameters given to one node. The node takes those it knows; what remains is an error.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Given {
    given: BTreeMap<String, Value>,
    known: Vec<String>,
}

impl Given {
    /// Collects parameters; of two with the same name the later wins.
    pub(crate) fn new(given: impl IntoIterator<Item = (String, Value)>) -> Self {
        Self {
            given: given.into_iter().collect(),
            known: Vec::new(),
        }
    }

    /// Removes and returns a parameter, `None` if it was not given.
    ///
    /// An integer is accepted where a floating-point number is asked for; otherwise types must agree.
    pub fn take<T: FromParameter>(&mut self, name: &str) -> Result<Option<T>, ParameterError> {
        self.known.push(name.into());
        let Some(value) = self.given.remove(name) else {
            return Ok(None);
        };
        T::from_parameter(&value)
            .map(Some)
            .ok_or_else(|| ParameterError::Type {
                name: name.into(),
                value: yaml_text(&value),
                expected: T::EXPECTED,
            })
    }

    /// What has not been taken.
    pub(super) fn into_values(self) -> BTreeMap<String, Value> {
        self.given
    }

    /// Fails if a parameter was given that the node did not take.
    pub fn finish(self) -> Result<(), ParameterError> {
        let unknown = self.given.into_keys().find(|name| {
            !ALWAYS_ALLOWED.contains(&name.as_str()) && !name.starts_with(ALWAYS_ALLOWED_PREFIX)
        });
        match unknown {
            None => Ok(()),
            Some(name) => Err(ParameterError::Unknown {
                name,
                known: self.known,
            }),
        }
    }
}

pub(super) fn yaml_text(value: &Value) -> String {
    serde_yaml_ng::to_string(value).map_or_else(|_| format!("{value:?}"), |text| text.trim().into())
}

impl FromParameter for bool {
    const EXPECTED: &'static str = "true or false";

    fn from_parameter(value: &Value) -> Option<Self> {
        match value {
            Value::Bool(flag) => Some(*flag),
            // ROS 2 reads YAML 1.1, where these are booleans too.
            Value::String(word) => match word.to_ascii_lowercase().as_str() {
                "y" | "yes" | "on" => Some(true),
                "n" | "no" | "off" => Some(false),
                _ => None,
            },
            _ => None,
        }
    }
}

impl FromParameter for f64 {
    const EXPECTED: &'static str = "a number";

    fn from_parameter(value: &Value) -> Option<Self> {
        value.as_f64()
    }
}

impl FromParameter for String {
    const EXPECTED: &'static str = "a string";

    fn from_parameter(value: &Value) -> Option<Self> {
        value.as_str().map(Into::into)
    }
}

impl FromParameter for PathBuf {
    const EXPECTED: &'static str = "a path";

    fn from_parameter(value: &Value) -> Option<Self> {
        value.as_str().map(Into::into)
    }
}

macro_rules! integer_parameter {
    ($($integer:ty: $expected:literal),* $(,)?) => {$(
        impl FromParameter for $integer {
            const EXPECTED: &'static str = $expected;

            fn from_parameter(value: &Value) -> Option<Self> {
                match value.as_i64() {
                    Some(integer) => integer.try_into().ok(),
                    None => value.as_u64()?.try_into().ok(),
                }
            }
        }
    )*};
}
integer_parameter!(
    i64: "an integer",
    u64: "a non-negative integer",
    u32: "a non-negative 32-bit integer",
    usize: "a non-negative integer",
);

macro_rules! list_parameter {
    ($($element:ty: $expected:literal),* $(,)?) => {$(
        impl FromParameter for Vec<$element> {
            const EXPECTED: &'static str = $expected;

            fn from_parameter(value: &Value) -> Option<Self> {
                value
                    .as_sequence()?
                    .iter()
                    .map(<$element>::from_parameter)
                    .collect()
            }
        }
    )*};
}
list_parameter!(
    bool: "a list of booleans",
    i64: "a list of integers",
    f64: "a list of numbers",
    String: "a list of strings",
);

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters(text: &str) -> Given {
        let map: BTreeMap<String, Value> = serde_yaml_ng::from_str(text).unwrap();
        Given::new(map)
    }

    #[test]
    fn values_are_typed() {
        let mut given = parameters(
            "{rate: 2.5, steps: 10, name: chaser, on: yes, list: [1, 2.5], bodies: [a, b], big: 18446744073709551615, e: 1e3, i: .inf}",
        );
        assert_eq!(given.take("rate"), Ok(Some(2.5)));
        assert_eq!(given.clone().take("steps"), Ok(Some(10.0)));
        assert_eq!(given.take("steps"), Ok(Some(10_u64)));
        assert_eq!(given.take("name"), Ok(Some("chaser".to_string())));
        assert_eq!(given.take("on"), Ok(Some(true)));
        assert_eq!(given.take("list"), Ok(Some(vec![1.0, 2.5])));
        assert_eq!(
            given.take("bodies"),
            Ok(Some(vec!["a".to_string(), "b".into()]))
        );
        assert_eq!(given.take("big"), Ok(Some(u64::MAX)));
        assert_eq!(given.take("e"), Ok(Some(1000.0)));
        assert_eq!(given.take("i"), Ok(Some(f64::INFINITY)));
        assert_eq!(given.take::<bool>("absent"), Ok(None));
        assert_eq!(given.finish(), Ok(()));
    }

    #[test]
    fn a_wrong_type_shows_name_value_and_expectation() {
        let mut given = parameters("{rate: fast, count: -1, flag: 1}");
        assert_eq!(
            given.take::<f64>("rate"),
            Err(ParameterError::Type {
                name: "rate".into(),
                value: "fast".into(),
                expected: "a number"
            })
        );
        assert!(given.take::<u32>("count").is_err());
        assert!(given.take::<bool>("flag").is_err());
    }

    #[test]
    fn unknown_parameters_are_errors_that_name_the_known() {
        let mut given = parameters("{rte: 1.0, use_sim_time: true, qos_overrides./x.depth: 3}");
        given.take::<f64>("rate").unwrap();
        let error = given.clone().finish().unwrap_err();
        assert_eq!(
            error.to_string(),
            "unknown parameter \"rte\"; this node has rate"
        );
        given.take::<f64>("rte").unwrap();
        assert_eq!(given.finish(), Ok(()));
    }
}
