//! Numeric values of a payload.

use crate::definition::Number;

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

/// An array of numbers of one type.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Values<'a> {
    pub(super) number: Number,
    pub(super) big_endian: bool,
    pub(super) bytes: &'a [u8],
}

impl<'a> Values<'a> {
    pub fn iter(self) -> impl Iterator<Item = Value> + 'a {
        let chunks = self.bytes.chunks_exact(self.number.size());
        chunks.map(move |bytes| value(self.number, bytes, self.big_endian))
    }

    /// Returns the type of the numbers.
    pub fn number(self) -> Number {
        self.number
    }

    /// Returns the bytes of the numbers if they are of type `uint8`.
    pub fn octets(self) -> Option<&'a [u8]> {
        (self.number == Number::Uint8).then_some(self.bytes)
    }
}

/// Decodes a number from its bytes.
pub(super) fn value(number: Number, bytes: &[u8], big_endian: bool) -> Value {
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
