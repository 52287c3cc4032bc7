use lgvi_control::ParameterError;
use lgvi_dynamics::MethodError;
use lgvi_dynamics::auto::ChoiceError;
use thiserror::Error;

use crate::{position, suggestion};

/// Maximum length of a scene's text (bytes). The parsed TOML can take a hundred times as much memory.
pub const LONGEST: usize = 4 << 20;

/// The reason that a scene cannot be flown.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SceneError {
    /// The text is not TOML, a key is unknown or missing, or a value has the wrong type. The message includes the line.
    #[error("{0}")]
    Syntax(String),
    /// The text is longer than [`LONGEST`].
    #[error("it is longer than {LONGEST} bytes")]
    TooLong,
    /// A value is out of its range.
    #[error("{}`{key}` is {value}, expected {expected}", place(*line))]
    Value {
        /// Line of the text, counted from 1, if the key or a table of it is there.
        line: Option<usize>,
        /// Path of the key, such as `bodies[0].inertia`.
        key: String,
        /// The value in the file.
        value: String,
        /// A description of valid values.
        expected: String,
    },
}

/// Maximum number of characters of a value in a message.
const MOST: usize = 300;

/// Returns the whole text, or its beginning and its length if it is long.
fn excerpt(text: &str) -> String {
    match text.char_indices().nth(MOST) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}… ({} bytes)", &text[..end], text.len()),
    }
}

/// Returns the beginning of a message about a line.
fn place(line: Option<usize>) -> String {
    line.map_or_else(String::new, |line| format!("line {line}: "))
}

impl SceneError {
    /// Converts a TOML error. Each line of the message is shortened, because a line that it quotes may be as long as
    /// the file.
    pub(crate) fn syntax(error: &toml::de::Error) -> Self {
        let text = error.to_string();
        let mut lines: Vec<_> = text.lines().map(excerpt).collect();
        if let Some(name) = suggestion::of_message(&text) {
            lines.push(format!("did you mean `{name}`?"));
        }
        Self::Syntax(lines.join("\n"))
    }

    /// Adds the line of the key.
    pub(crate) fn located(self, text: &str) -> Self {
        match self {
            Self::Value {
                line: None,
                key,
                value,
                expected,
            } => Self::Value {
                line: position::line(text, &key),
                key,
                value,
                expected,
            },
            error => error,
        }
    }

    pub(crate) fn value(
        key: impl Into<String>,
        value: impl std::fmt::Debug,
        expected: impl Into<String>,
    ) -> Self {
        Self::Value {
            line: None,
            key: key.into(),
            value: excerpt(&format!("{value:?}")),
            expected: expected.into(),
        }
    }

    /// Returns the error of a maneuver as that of its companion with this index.
    pub(crate) fn of_companion(self, index: usize) -> Self {
        let moved = |key: &str| {
            let rest = key.strip_prefix("maneuver.")?;
            Some(format!("maneuver.companions[{index}].{rest}"))
        };
        match self {
            Self::Value {
                line,
                key,
                value,
                expected,
            } => Self::Value {
                line,
                key: moved(&key).unwrap_or(key),
                value,
                expected,
            },
            error => error,
        }
    }

    /// Returns the error for a name that is none of those that are known.
    pub(crate) fn unknown(key: impl Into<String>, name: &str, known: &[&str]) -> Self {
        Self::value(key, name, suggestion::one_of(name, known))
    }

    /// Returns the error for a parameter of a constraint or a terminal condition that is written at `key`.
    pub(crate) fn parameter(key: impl Into<String>, error: ParameterError) -> Self {
        Self::Value {
            line: None,
            key: key.into(),
            value: excerpt(&error.value),
            expected: error.expected,
        }
    }

    /// Returns the error for a required key that is missing.
    pub(crate) fn missing(key: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::Value {
            line: None,
            key: key.into(),
            value: "missing".into(),
            expected: expected.into(),
        }
    }
}

/// The reason that a scene has no integrator.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SchemeError {
    /// The method cannot integrate the bodies.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// The automatic choice of a method failed.
    #[error("no integrator was chosen: {0}")]
    Choice(#[from] ChoiceError),
}
