//! The first place where record and repetition differ.

use std::fmt::{self, Display, Formatter};

use serde::{Serialize, Serializer};

/// Where they differ, and what each has there.
#[derive(Debug, Serialize)]
pub struct Difference {
    /// Step of the state.
    pub step: u64,
    /// The body.
    pub body: String,
    /// The field, with the index of its element.
    pub field: String,
    /// What the bag has there.
    pub recorded: Value,
    /// What the repetition gives.
    pub computed: Value,
}

/// What a field holds. Numbers are the same only where all their bits are.
#[derive(Debug)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A whole number.
    Integer(i64),
    /// A text.
    Text(String),
}

impl PartialEq for Value {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Number(one), Self::Number(other)) => one.to_bits() == other.to_bits(),
            (Self::Integer(one), Self::Integer(other)) => one == other,
            (Self::Text(one), Self::Text(other)) => one == other,
            _ => false,
        }
    }
}

/// JSON has no NaN and no infinity: they are the texts that tables have for them.
impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number(number) if number.is_finite() => serializer.serialize_f64(*number),
            Self::Number(number) => serializer.collect_str(number),
            Self::Integer(number) => serializer.serialize_i64(*number),
            Self::Text(text) => serializer.serialize_str(text),
        }
    }
}

impl Display for Value {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number:e}"),
            Self::Integer(number) => write!(f, "{number}"),
            Self::Text(text) => write!(f, "{text:?}"),
        }
    }
}

impl Display for Difference {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self {
            body,
            field,
            recorded,
            computed,
            ..
        } = self;
        write!(
            f,
            "{body} {field} is {recorded}, the repetition gives {computed}"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_json_does_not_know_are_texts() {
        let json = |number| serde_json::to_string(&Value::Number(number)).unwrap();
        assert_eq!(json(0.5), "0.5");
        assert_eq!(json(f64::NAN), "\"NaN\"");
        assert_eq!(json(f64::INFINITY), "\"inf\"");
        assert_eq!(json(f64::NEG_INFINITY), "\"-inf\"");
    }

    #[test]
    fn numbers_are_compared_by_their_bits() {
        assert_ne!(Value::Number(0.0), Value::Number(-0.0));
        assert_eq!(Value::Number(f64::NAN), Value::Number(f64::NAN));
    }
}
