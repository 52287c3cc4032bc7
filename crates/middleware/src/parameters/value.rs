//! Values of parameters and their types.

use std::fmt;

use lgvi_msgs::rcl_interfaces::{self, ParameterType as Number};

/// A type that a parameter can have: `bool`, `i64`, `f64`, `String` and vectors of them.
pub trait ParameterType: Into<ParameterValue> {
    /// How it is called in ROS.
    const KIND: ParameterKind;

    /// The value, if it is of this type.
    fn from_value(value: ParameterValue) -> Option<Self>;
}

/// All that differs from type to type: its names here, in ROS and in messages, and what is expected, as it is said to the
/// user.
macro_rules! parameter_types {
    ($($kind:ident $rust:ty, $number:ident, $field:ident, $expected:literal;)*) => {
        /// The value of a parameter.
        #[derive(Debug, Clone, Default, PartialEq)]
        pub enum ParameterValue {
            /// None.
            #[default]
            NotSet,
            /// Bytes. No parameter is declared as such; a client may try to set one to them.
            ByteArray(Vec<u8>),
            $(#[doc = concat!("What is said to be ", $expected, ".")] $kind($rust),)*
        }

        /// The type that a parameter is declared with.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum ParameterKind {
            $(#[doc = concat!("`", stringify!($rust), "`")] $kind,)*
        }

        impl ParameterKind {
            /// What is expected, as it is said to the user.
            pub const fn expected(self) -> &'static str {
                match self {
                    $(Self::$kind => $expected,)*
                }
            }

            /// `rcl_interfaces/msg/ParameterType`
            pub(super) const fn number(self) -> u8 {
                match self {
                    $(Self::$kind => Number::$number,)*
                }
            }

            /// The least value of this type: `false`, 0, or nothing.
            fn least(self) -> ParameterValue {
                match self {
                    $(Self::$kind => <$rust>::default().into(),)*
                }
            }
        }

        impl ParameterValue {
            /// `rcl_interfaces/msg/ParameterType`
            pub(super) const fn number(&self) -> u8 {
                match self {
                    Self::NotSet => Number::PARAMETER_NOT_SET,
                    Self::ByteArray(_) => Number::PARAMETER_BYTE_ARRAY,
                    $(Self::$kind(_) => Number::$number,)*
                }
            }

            pub(super) fn to_message(&self) -> rcl_interfaces::ParameterValue {
                let mut message = rcl_interfaces::ParameterValue {
                    r#type: self.number(),
                    ..Default::default()
                };
                match self.clone() {
                    Self::NotSet => {}
                    Self::ByteArray(value) => message.byte_array_value = value,
                    $(Self::$kind(value) => message.$field = value,)*
                }
                message
            }

            /// The value of a message; `Err` with the type's number if there is no such type.
            pub(super) fn from_message(message: rcl_interfaces::ParameterValue) -> Result<Self, u8> {
                Ok(match message.r#type {
                    Number::PARAMETER_NOT_SET => Self::NotSet,
                    Number::PARAMETER_BYTE_ARRAY => Self::ByteArray(message.byte_array_value),
                    $(Number::$number => Self::$kind(message.$field),)*
                    number => return Err(number),
                })
            }
        }

        /// As in YAML, strings in quotes.
        impl fmt::Display for ParameterValue {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self {
                    Self::NotSet => f.write_str("not set"),
                    Self::ByteArray(value) => fmt::Debug::fmt(value, f),
                    $(Self::$kind(value) => fmt::Debug::fmt(value, f),)*
                }
            }
        }

        $(
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
        )*
    };
}
parameter_types!(
    Bool bool, PARAMETER_BOOL, bool_value, "true or false";
    Integer i64, PARAMETER_INTEGER, integer_value, "an integer";
    Double f64, PARAMETER_DOUBLE, double_value, "a number";
    String String, PARAMETER_STRING, string_value, "a string";
    BoolArray Vec<bool>, PARAMETER_BOOL_ARRAY, bool_array_value, "a list of booleans";
    IntegerArray Vec<i64>, PARAMETER_INTEGER_ARRAY, integer_array_value, "a list of integers";
    DoubleArray Vec<f64>, PARAMETER_DOUBLE_ARRAY, double_array_value, "a list of numbers";
    StringArray Vec<String>, PARAMETER_STRING_ARRAY, string_array_value, "a list of strings";
);

impl From<&str> for ParameterValue {
    fn from(value: &str) -> Self {
        Self::String(value.into())
    }
}

impl ParameterKind {
    /// The value as one of this type: integers are numbers too, and an empty list is one of anything.
    pub(super) fn accept(self, value: ParameterValue) -> Option<ParameterValue> {
        use ParameterValue as Value;
        #[allow(clippy::cast_precision_loss, reason = "as YAML is read")]
        let value = match (self, value) {
            (Self::Double, Value::Integer(integer)) => Value::Double(integer as f64),
            (Self::DoubleArray, Value::IntegerArray(integers)) => {
                Value::DoubleArray(integers.into_iter().map(|integer| integer as f64).collect())
            }
            (_, value) if value.is_empty_list() && self.least().is_empty_list() => self.least(),
            (_, value) => value,
        };
        (value.number() == self.number()).then_some(value)
    }
}

impl ParameterValue {
    /// Strings are in quotes.
    fn is_empty_list(&self) -> bool {
        self.to_string() == "[]"
    }
}
