use std::fmt;

#[cfg(feature = "iceoryx2")]
use iceoryx2::prelude::ZeroCopySend;
use thiserror::Error;

use crate::excerpt;

/// A body's name: up to 31 printable ASCII characters, padded with NUL. The default is no name.
#[repr(C)]
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "iceoryx2", derive(ZeroCopySend))]
#[cfg_attr(feature = "iceoryx2", type_name("lgvi/Name"))]
pub struct Name([u8; 32]);

/// A text that is no [`Name`].
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NameError {
    /// A name needs a character.
    #[error("a body's name is empty")]
    Empty,
    /// The name does not fit.
    #[error("body name {name:?} has {length} bytes, expected at most {max}", max = Name::MAX_LENGTH)]
    TooLong {
        /// The name, or its beginning.
        name: String,
        /// Its length in bytes.
        length: usize,
    },
    /// The name holds a control character or one beyond ASCII.
    #[error("body name {name:?} contains {character:?}, expected printable ASCII")]
    NotPrintable {
        /// The name, or its beginning.
        name: String,
        /// The first character that is not allowed.
        character: char,
    },
}

impl Name {
    /// Longest name in bytes.
    pub const MAX_LENGTH: usize = 31;

    /// The name without its padding.
    pub fn as_str(&self) -> &str {
        let text = self.0.split(|&byte| byte == 0).next().unwrap_or_default();
        // Another process may have written anything: what is no text ends the name.
        text.utf8_chunks().next().map_or("", |chunk| chunk.valid())
    }
}

impl TryFrom<&str> for Name {
    type Error = NameError;

    fn try_from(name: &str) -> Result<Self, NameError> {
        if name.is_empty() {
            return Err(NameError::Empty);
        }
        if let Some(character) = name.chars().find(|c| !c.is_ascii() || c.is_ascii_control()) {
            return Err(NameError::NotPrintable {
                name: excerpt(name),
                character,
            });
        }
        if name.len() > Self::MAX_LENGTH {
            return Err(NameError::TooLong {
                name: excerpt(name),
                length: name.len(),
            });
        }
        let mut bytes = [0; 32];
        bytes[..name.len()].copy_from_slice(name.as_bytes());
        Ok(Self(bytes))
    }
}

impl fmt::Display for Name {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.as_str())
    }
}

impl fmt::Debug for Name {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Name({:?})", self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_up_to_31_characters() {
        for name in ["a", "chaser", "a_name_of_just_31_characters_ok"] {
            assert_eq!(Name::try_from(name).unwrap().as_str(), name);
        }
    }

    #[test]
    fn refuses_what_it_cannot_hold() {
        assert_eq!(Name::try_from(""), Err(NameError::Empty));
        let long = "x".repeat(32);
        assert_eq!(
            Name::try_from(&*long),
            Err(NameError::TooLong {
                name: long.clone(),
                length: 32
            })
        );
        for (name, character) in [("naïve", 'ï'), ("a\0b", '\0'), ("a\n", '\n')] {
            assert_eq!(
                Name::try_from(name),
                Err(NameError::NotPrintable {
                    name: name.to_owned(),
                    character
                })
            );
        }
    }

    #[test]
    fn of_a_name_of_a_megabyte_the_beginning_is_told() {
        for letter in ["x", "ä"] {
            let error = Name::try_from(&*letter.repeat(1 << 20)).unwrap_err();
            assert!(error.to_string().len() < 300, "{error}");
        }
    }

    #[test]
    fn foreign_bytes_end_the_name() {
        let mut bytes = [b'x'; 32];
        assert_eq!(Name(bytes).as_str().len(), 32);
        bytes[2] = 0xff;
        assert_eq!(Name(bytes).as_str(), "xx");
    }
}
