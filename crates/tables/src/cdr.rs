//! Plain CDR of either byte order, read value by value as the definition says.
//!
//! Nothing is allocated for a length that the payload claims before the payload has been found to be long enough.
//! Alignment counts from the end of the encapsulation header. Source: OMG DDS-XTypes 1.3, 7.4.1 (`PLAIN_CDR`).

use std::borrow::Cow;
use std::fmt::Display;

use thiserror::Error;

use crate::definition::{Length, Message, Number, Text, Type};

/// Bytes of the encapsulation header.
const HEADER: usize = 4;

/// Payloads are padded to four bytes, so that up to this many may follow the message.
const MAX_PADDING: usize = 3;

/// A payload that is not what its definition says.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}{fault}", prefix(.path))]
pub struct DecodeError {
    /// The field, as `pose.position.x`; empty for the payload as a whole.
    pub path: String,
    /// What is wrong with it.
    pub fault: Fault,
}

fn prefix(path: &str) -> String {
    if path.is_empty() {
        String::new()
    } else {
        format!("{path}: ")
    }
}

/// What is wrong with a payload.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Fault {
    /// Fewer bytes than the encapsulation header has.
    #[error("{length} bytes are too few for the encapsulation header of {HEADER}")]
    NoHeader {
        /// Bytes found.
        length: usize,
    },
    /// An encapsulation other than plain CDR.
    #[error("encapsulation {found:#06x}, expected plain CDR: 0x0000 or 0x0001")]
    Encapsulation {
        /// The identifier found.
        found: u16,
    },
    /// The payload ends before the value does.
    #[error("needs {needed} bytes at byte {position}, {left} are left")]
    Short {
        /// Where, counted from the start of the payload.
        position: usize,
        /// Bytes that are needed.
        needed: usize,
        /// Bytes that are left.
        left: usize,
    },
    /// A truth value is neither 0 nor 1.
    #[error("truth value {found}, expected 0 or 1")]
    Truth {
        /// The octet found.
        found: u8,
    },
    /// More elements, bytes or units than the definition allows.
    #[error("length {found}, expected at most {bound}")]
    Bound {
        /// The length found.
        found: usize,
        /// The bound of the definition.
        bound: usize,
    },
    /// Another number of elements than all messages before.
    #[error("{found} elements, expected {expected} as in all messages before")]
    Length {
        /// The length found.
        found: usize,
        /// The length of the others.
        expected: usize,
    },
    /// A `string` does not end with a zero.
    #[error("text of {length} bytes does not end with a zero")]
    Unterminated {
        /// Its length with what should be the zero.
        length: usize,
    },
    /// A text is no Unicode.
    #[error("text is no valid Unicode after {valid} bytes or units")]
    Unicode {
        /// How much of it is.
        valid: usize,
    },
    /// More bytes than the message and its padding take.
    #[error(
        "ends after {consumed} of {length} bytes, expected at most {MAX_PADDING} bytes of padding"
    )]
    Trailing {
        /// Bytes that the message takes, encapsulation header included.
        consumed: usize,
        /// Bytes found.
        length: usize,
    },
}

impl From<Fault> for DecodeError {
    fn from(fault: Fault) -> Self {
        Self {
            path: String::new(),
            fault,
        }
    }
}

impl DecodeError {
    /// The error of a field or element, as that of what has it.
    pub(crate) fn within(self, segment: impl Display) -> Self {
        let Self { path, fault } = self;
        let path = if path.is_empty() {
            segment.to_string()
        } else {
            format!("{segment}.{path}")
        };
        Self { path, fault }
    }
}

/// A number of any type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Value {
    Bool(bool),
    Int8(i8),
    Uint8(u8),
    Int16(i16),
    Uint16(u16),
    Int32(i32),
    Uint32(u32),
    Int64(i64),
    Uint64(u64),
    Float32(f32),
    Float64(f64),
}

/// Numbers of one type, one after the other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Values<'a> {
    number: Number,
    big_endian: bool,
    bytes: &'a [u8],
}

impl<'a> Values<'a> {
    pub fn iter(self) -> impl Iterator<Item = Value> + 'a {
        let chunks = self.bytes.chunks_exact(self.number.size());
        chunks.map(move |bytes| value(self.number, bytes, self.big_endian))
    }

    /// Their bytes, if each has one.
    pub fn octets(self) -> Option<&'a [u8]> {
        (self.number == Number::Uint8).then_some(self.bytes)
    }
}

/// The number of a few bytes.
fn value(number: Number, bytes: &[u8], big_endian: bool) -> Value {
    let append = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
    let bits = if big_endian {
        bytes.iter().fold(0, append)
    } else {
        bytes.iter().rev().fold(0, append)
    };
    match number {
        Number::Bool => Value::Bool(bits != 0),
        Number::Int8 => Value::Int8(bits as i8),
        Number::Uint8 => Value::Uint8(bits as u8),
        Number::Int16 => Value::Int16(bits as i16),
        Number::Uint16 => Value::Uint16(bits as u16),
        Number::Int32 => Value::Int32(bits as i32),
        Number::Uint32 => Value::Uint32(bits as u32),
        Number::Int64 => Value::Int64(bits as i64),
        Number::Uint64 => Value::Uint64(bits),
        Number::Float32 => Value::Float32(f32::from_bits(bits as u32)),
        Number::Float64 => Value::Float64(f64::from_bits(bits)),
    }
}

/// Goes through a payload.
pub(crate) struct Reader<'a> {
    payload: &'a [u8],
    /// In the payload.
    position: usize,
    big_endian: bool,
}

impl<'a> Reader<'a> {
    /// Reads the encapsulation header.
    pub fn new(payload: &'a [u8]) -> Result<Self, Fault> {
        let Some(header) = payload.first_chunk::<HEADER>() else {
            return Err(Fault::NoHeader {
                length: payload.len(),
            });
        };
        let big_endian = match u16::from_be_bytes([header[0], header[1]]) {
            0 => true,
            1 => false,
            found => return Err(Fault::Encapsulation { found }),
        };
        Ok(Self {
            payload,
            position: HEADER,
            big_endian,
        })
    }

    /// Nothing but padding may be left.
    pub fn finish(self) -> Result<(), Fault> {
        if self.payload.len() - self.position > MAX_PADDING {
            return Err(Fault::Trailing {
                consumed: self.position,
                length: self.payload.len(),
            });
        }
        Ok(())
    }

    /// Bytes that are aligned to multiples of `alignment`.
    fn take(&mut self, length: usize, alignment: usize) -> Result<&'a [u8], Fault> {
        let start = (self.position - HEADER).next_multiple_of(alignment) + HEADER;
        let left = self.payload.get(start..).unwrap_or_default();
        let bytes = left.get(..length).ok_or(Fault::Short {
            position: start.min(self.payload.len()),
            needed: length,
            left: left.len(),
        })?;
        self.position = start + length;
        Ok(bytes)
    }

    pub fn number(&mut self, number: Number) -> Result<Value, Fault> {
        let bytes = self.take(number.size(), number.size())?;
        check_truth(number, bytes)?;
        Ok(value(number, bytes, self.big_endian))
    }

    /// Numbers of one type.
    pub fn numbers(&mut self, number: Number, count: usize) -> Result<Values<'a>, Fault> {
        let size = number.size();
        // Where there are none, nothing is aligned.
        let alignment = if count == 0 { 1 } else { size };
        let bytes = self.take(count.saturating_mul(size), alignment)?;
        check_truth(number, bytes)?;
        Ok(Values {
            number,
            big_endian: self.big_endian,
            bytes,
        })
    }

    fn length(&mut self) -> Result<usize, Fault> {
        let bytes = self.take(4, 4)?;
        match value(Number::Uint32, bytes, self.big_endian) {
            Value::Uint32(length) => Ok(length as usize),
            _ => Ok(0),
        }
    }

    /// Number of an array's elements, for which the payload is long enough.
    pub fn count(&mut self, length: Length, element: &Type) -> Result<usize, Fault> {
        let count = match length {
            Length::Fixed(count) => count,
            Length::Unbounded => self.length()?,
            Length::Bounded(bound) => within(self.length()?, bound)?,
        };
        let (needed, left) = (
            count.saturating_mul(element.least()),
            self.payload.len() - self.position,
        );
        if needed > left {
            return Err(Fault::Short {
                position: self.position,
                needed,
                left,
            });
        }
        Ok(count)
    }

    pub fn text(&mut self, text: Text) -> Result<Cow<'a, str>, Fault> {
        let length = self.length()?;
        let bound = text.bound.unwrap_or(usize::MAX);
        if text.wide {
            return self.wide_text(within(length, bound)?).map(Cow::Owned);
        }
        let bytes = self.take(length, 1)?;
        // Some writers give an empty text no zero.
        let bytes = match bytes.split_last() {
            Some((0, bytes)) => bytes,
            None => bytes,
            Some(_) => return Err(Fault::Unterminated { length }),
        };
        within(bytes.len(), bound)?;
        let text = str::from_utf8(bytes).map_err(|error| Fault::Unicode {
            valid: error.valid_up_to(),
        })?;
        Ok(Cow::Borrowed(text))
    }

    /// Units of UTF-16 in four bytes each, as all of ROS 2's middleware writes them, without a zero at the end.
    fn wide_text(&mut self, length: usize) -> Result<String, Fault> {
        let mut units = self.numbers(Number::Uint32, length)?.iter();
        let mut text = String::new();
        let mut valid = 0;
        let units = std::iter::from_fn(|| match units.next()? {
            // What is no unit becomes half a character, which is refused below.
            Value::Uint32(unit) => Some(u16::try_from(unit).unwrap_or(0xd800)),
            _ => None,
        });
        for character in char::decode_utf16(units) {
            let character = character.map_err(|_| Fault::Unicode { valid })?;
            valid += character.len_utf16();
            text.push(character);
        }
        Ok(text)
    }

    /// To be called before the fields of a message: one without fields has an octet instead.
    pub fn open(&mut self, message: &Message) -> Result<(), Fault> {
        // Some writers leave it out where the message is all of the payload.
        let all = self.payload.len() == HEADER;
        if message.fields.is_empty() && !all {
            self.take(1, 1)?;
        }
        Ok(())
    }

    /// Reads a value for nothing but its faults.
    pub fn skip(&mut self, kind: &Type) -> Result<(), DecodeError> {
        match kind {
            Type::Number(number) => self.number(*number).map(drop)?,
            Type::Text(text) => self.text(*text).map(drop)?,
            Type::Message(message) => {
                self.open(message)?;
                for field in &message.fields {
                    self.skip(&field.kind)
                        .map_err(|error| error.within(&field.name))?;
                }
            }
            Type::Array { element, length } => {
                let count = self.count(*length, element)?;
                self.skip_elements(element, count)?;
            }
        }
        Ok(())
    }

    /// Reads elements of an array for nothing but their faults.
    pub fn skip_elements(&mut self, element: &Type, count: usize) -> Result<(), DecodeError> {
        if let Type::Number(number) = *element {
            self.numbers(number, count)?;
            return Ok(());
        }
        for index in 0..count {
            self.skip(element).map_err(|error| error.within(index))?;
        }
        Ok(())
    }
}

fn within(found: usize, bound: usize) -> Result<usize, Fault> {
    if found > bound {
        return Err(Fault::Bound { found, bound });
    }
    Ok(found)
}

fn check_truth(number: Number, bytes: &[u8]) -> Result<(), Fault> {
    if number != Number::Bool {
        return Ok(());
    }
    match bytes.iter().find(|byte| **byte > 1) {
        Some(&found) => Err(Fault::Truth { found }),
        None => Ok(()),
    }
}
