//! Values of parameters and their types.

use std::fmt;

use lgvi_msgs::rcl_interfaces::{self, ParameterType as Number};

/// The value of a parameter.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum ParameterValue {
    /// None.
    #[default]
    NotSet,
    /// A boolean.
    Bool(bool),
    /// An integer.
    Integer(i64),
    /// A floating-point number.
    Double(f64),
    /// A string.
    String(String),
    /// Bytes. No parameter is declared as such; a client may try to set one to them.
    ByteArray(Vec<u8>),
    /// A list of booleans.
    BoolArray(Vec<bool>),
    /// A list of integers.
    IntegerArray(Vec<i64>),
    /// A list of floating-point numbers.
    DoubleArray(Vec<f64>),
    /// A list of strings.
    StringArray(Vec<String>),
}

/// The type that a parameter is declared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKind {
    /// `bool`
    Bool,
    /// `i64`
    Integer,
    /// `f64`
    Double,
    /// `String`
    String,
    /// `Vec<bool>`
    BoolArray,
    /// `Vec<i64>`
    IntegerArray,
    /// `Vec<f64>`
    DoubleArray,
    /// `Vec<String>`
    StringArray,
}

/// A type that a parameter can have: `bool`, `i64`, `f64`, `String` and vectors of them.
pub trait ParameterType: Into<ParameterValue> {
    /// How it is called in ROS.
    const KIND: ParameterKind;

    /// The value, if it is of this type.
    fn from_value(value: ParameterValue) -> Option<Self>;
}

macro_rules! parameter_types {
    ($($rust:ty => $kind:ident),* $(,)?) => {$(
        impl From<$rust> for ParameterValue {
            fn from(value: $rust) -> Self {
                Self::$kind(value)
            }
        }

        impl ParameterType for $rust {
            const KIND: ParameterKind = ParameterKind::$kind;

            fn from_value(value: ParameterValue) -> Option<Self> {
                match value {
                    ParameterValue::$kind(value) => Some(value),
                    _ => None,
                }
            }
        }
    )*};
}
parameter_types!(
    bool => Bool,
    i64 => Integer,
    f64 => Double,
    String => String,
    Vec<bool> => BoolArray,
    Vec<i64> => IntegerArray,
    Vec<f64> => DoubleArray,
    Vec<String> => StringArray,
);

impl From<&str> for ParameterValue {
    fn from(value: &str) -> Self {
        Self::String(value.into())
    }
}

impl ParameterKind {
    /// What is expected, as it is said to the user.
    pub const fn expected(self) -> &'static str {
        match self {
            Self::Bool => "true or false",
            Self::Integer => "an integer",
            Self::Double => "a number",
            Self::String => "a string",
            Self::BoolArray => "a list of booleans",
            Self::IntegerArray => "a list of integers",
            Self::DoubleArray => "a list of numbers",
            Self::StringArray => "a list of strings",
        }
    }

    /// `rcl_interfaces/msg/ParameterType`
    pub(super) const fn number(self) -> u8 {
        match self {
            Self::Bool => Number::PARAMETER_BOOL,
            Self::Integer => Number::PARAMETER_INTEGER,
            Self::Double => Number::PARAMETER_DOUBLE,
            Self::String => Number::PARAMETER_STRING,
            Self::BoolArray => Number::PARAMETER_BOOL_ARRAY,
            Self::IntegerArray => Number::PARAMETER_INTEGER_ARRAY,
            Self::DoubleArray => Number::PARAMETER_DOUBLE_ARRAY,
            Self::StringArray => Number::PARAMETER_STRING_ARRAY,
        }
    }

    /// The value as one of this type: integers are numbers too, and an empty list is one of anything.
    pub(super) fn accept(self, value: ParameterValue) -> Option<ParameterValue> {
        use ParameterValue as Value;
        #[allow(clippy::cast_precision_loss, reason = "as YAML is read")]
        let value = match (self, value) {
            (Self::Double, Value::Integer(integer)) => Value::Double(integer as f64),
            (Self::DoubleArray, Value::IntegerArray(integers)) => {
                Value::DoubleArray(integers.into_iter().map(|integer| integer as f64).collect())
            }
            (_, value) if value.is_empty_list() => self.empty_list()?,
            (_, value) => value,
        };
        (value.number() == self.number()).then_some(value)
    }

    fn empty_list(self) -> Option<ParameterValue> {
        match self {
            Self::BoolArray => Some(Vec::<bool>::new().into()),
            Self::IntegerArray => Some(Vec::<i64>::new().into()),
            Self::DoubleArray => Some(Vec::<f64>::new().into()),
            Self::StringArray => Some(Vec::<String>::new().into()),
            _ => None,
        }
    }
}

impl ParameterValue {
    /// `rcl_interfaces/msg/ParameterType`
    pub(super) const fn number(&self) -> u8 {
        match self {
            Self::NotSet => Number::PARAMETER_NOT_SET,
            Self::Bool(_) => Number::PARAMETER_BOOL,
            Self::Integer(_) => Number::PARAMETER_INTEGER,
            Self::Double(_) => Number::PARAMETER_DOUBLE,
            Self::String(_) => Number::PARAMETER_STRING,
            Self::ByteArray(_) => Number::PARAMETER_BYTE_ARRAY,
            Self::BoolArray(_) => Number::PARAMETER_BOOL_ARRAY,
            Self::IntegerArray(_) => Number::PARAMETER_INTEGER_ARRAY,
            Self::DoubleArray(_) => Number::PARAMETER_DOUBLE_ARRAY,
            Self::StringArray(_) => Number::PARAMETER_STRING_ARRAY,
        }
    }

    fn is_empty_list(&self) -> bool {
        match self {
            Self::ByteArray(items) => items.is_empty(),
            Self::BoolArray(items) => items.is_empty(),
            Self::IntegerArray(items) => items.is_empty(),
            Self::DoubleArray(items) => items.is_empty(),
            Self::StringArray(items) => items.is_empty(),
            _ => false,
        }
    }

    pub(super) fn to_message(&self) -> rcl_interfaces::ParameterValue {
        let mut message = rcl_interfaces::ParameterValue {
            r#type: self.number(),
            ..Default::default()
        };
        match self.clone() {
            Self::NotSet => {}
            Self::Bool(value) => message.bool_value = value,
            Self::Integer(value) => message.integer_value = value,
            Self::Double(value) => message.double_value = value,
            Self::String(value) => message.string_value = value,
            Self::ByteArray(value) => message.byte_array_value = value,
            Self::BoolArray(value) => message.bool_array_value = value,
            Self::IntegerArray(value) => message.integer_array_value = value,
            Self::DoubleArray(value) => message.double_array_value = value,
            Self::StringArray(value) => message.string_array_value = value,
        }
        message
    }

    /// The value of a message; `Err` with the type's number if there is no such type.
    pub(super) fn from_message(message: rcl_interfaces::ParameterValue) -> Result<Self, u8> {
        Ok(match message.r#type {
            Number::PARAMETER_NOT_SET => Self::NotSet,
            Number::PARAMETER_BOOL => Self::Bool(message.bool_value),
            Number::PARAMETER_INTEGER => Self::Integer(message.integer_value),
            Number::PARAMETER_DOUBLE => Self::Double(message.double_value),
            Number::PARAMETER_STRING => Self::String(message.string_value),
            Number::PARAMETER_BYTE_ARRAY => Self::ByteArray(message.byte_array_value),
            Number::PARAMETER_BOOL_ARRAY => Self::BoolArray(message.bool_array_value),
            Number::PARAMETER_INTEGER_ARRAY => Self::IntegerArray(message.integer_array_value),
            Number::PARAMETER_DOUBLE_ARRAY => Self::DoubleArray(message.double_array_value),
            Number::PARAMETER_STRING_ARRAY => Self::StringArray(message.string_array_value),
            number => return Err(number),
        })
    }
}

/// As in YAML, strings in quotes.
impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotSet => f.write_str("not set"),
            Self::Bool(value) => value.fmt(f),
            Self::Integer(value) => value.fmt(f),
            Self::Double(value) => fmt::Debug::fmt(value, f),
            Self::String(value) => fmt::Debug::fmt(value, f),
            Self::ByteArray(value) => fmt::Debug::fmt(value, f),
            Self::BoolArray(value) => fmt::Debug::fmt(value, f),
            Self::IntegerArray(value) => fmt::Debug::fmt(value, f),
            Self::DoubleArray(value) => fmt::Debug::fmt(value, f),
            Self::StringArray(value) => fmt::Debug::fmt(value, f),
        }
    }
}
