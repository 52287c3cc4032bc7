use lgvi_control::ParameterError;
use lgvi_dynamics::MethodError;
use lgvi_dynamics::auto::ChoiceError;
use thiserror::Error;

/// The longest text of a scene (bytes). What TOML makes of it may take a hundred times as much.
pub const LONGEST: usize = 4 << 20;

/// Why a scene cannot be flown.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SceneError {
    /// Not TOML, an unknown or missing key, or a value of the wrong type; with its line.
    #[error("{0}")]
    Syntax(String),
    /// More text than any scene needs.
    #[error("it is longer than {LONGEST} bytes")]
    TooLong,
    /// A value out of its range.
    #[error("`{key}` is {value}, expected {expected}")]
    Value {
        /// Path of the key, such as `bodies[0].inertia`.
        key: String,
        /// What the file says.
        value: String,
        /// What would do.
        expected: String,
    },
}

/// Letters of a value that are told.
const MOST: usize = 300;

/// All of a text, or its beginning and how long it is.
fn excerpt(text: &str) -> String {
    match text.char_indices().nth(MOST) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}… ({} bytes)", &text[..end], text.len()),
    }
}

impl SceneError {
    /// What is no scene's form; the line that is shown may be as long as the file.
    pub(crate) fn syntax(error: &toml::de::Error) -> Self {
        let text = error.to_string();
        let lines: Vec<_> = text.lines().map(excerpt).collect();
        Self::Syntax(lines.join("\n"))
    }

    pub(crate) fn value(
        key: impl Into<String>,
        value: impl std::fmt::Debug,
        expected: impl Into<String>,
    ) -> Self {
        Self::Value {
            key: key.into(),
            value: excerpt(&format!("{value:?}")),
            expected: expected.into(),
        }
    }

    /// For a parameter of a constraint or a terminal condition that is written at `key`.
    pub(crate) fn parameter(key: impl Into<String>, error: ParameterError) -> Self {
        Self::Value {
            key: key.into(),
            value: excerpt(&error.value),
            expected: error.expected,
        }
    }

    /// For a key that is not there and should be.
    pub(crate) fn missing(key: impl Into<String>, expected: impl Into<String>) -> Self {
        Self::Value {
            key: key.into(),
            value: "missing".into(),
            expected: expected.into(),
        }
    }
}

/// Why there is no integrator for a scene.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SchemeError {
    /// The method cannot integrate the bodies.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// No method was chosen.
    #[error("no integrator was chosen: {0}")]
    Choice(#[from] ChoiceError),
}
