//! Sequential reader of a payload.

use std::borrow::Cow;

use super::value::value;
use super::{DecodeError, Fault, HEADER, MAX_PADDING, Value, Values};
use crate::definition::{Length, Message, Number, Text, Type};

/// Reads a payload from start to end.
pub(crate) struct Reader<'a> {
    payload: &'a [u8],
    /// Current position in the payload.
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

    /// Checks that only padding is left.
    pub fn finish(self) -> Result<(), Fault> {
        if self.payload.len() - self.position > MAX_PADDING {
            return Err(Fault::Trailing {
                consumed: self.position,
                length: self.payload.len(),
            });
        }
        Ok(())
    }

    /// Takes `length` bytes, starting at a multiple of `alignment`.
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

    /// Reads `count` numbers of one type.
    pub fn numbers(&mut self, number: Number, count: usize) -> Result<Values<'a>, Fault> {
        let size = number.size();
        // An empty array has no alignment.
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

    /// Returns the number of elements of an array, after checking that the payload is long enough for them.
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
        // Some writers omit the zero of an empty text.
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

    /// Reads UTF-16 code units in four bytes each without a terminating zero, as all ROS 2 middleware writes them.
    fn wide_text(&mut self, length: usize) -> Result<String, Fault> {
        let mut units = self.numbers(Number::Uint32, length)?.iter();
        let mut text = String::new();
        let mut valid = 0;
        let units = std::iter::from_fn(|| match units.next()? {
            // Numbers that do not fit a code unit are replaced by a lone surrogate, which is refused below.
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

    /// Starts a message. The caller must call this before reading its fields. A message without fields has one octet
    /// instead.
    pub fn open(&mut self, message: &Message) -> Result<(), Fault> {
        // Some writers omit the octet if the message is the whole payload.
        let all = self.payload.len() == HEADER;
        if message.fields.is_empty() && !all {
            self.take(1, 1)?;
        }
        Ok(())
    }

    /// Reads a value only to check it.
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

    /// Reads elements of an array only to check them.
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
