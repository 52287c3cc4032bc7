//! Random payloads of any message type.

use fastrand::Rng;

use crate::definition::{Length, Message, Number, Text, Type};

/// Writes random values.
pub struct Writer {
    random: Rng,
    big_endian: bool,
    body: Vec<u8>,
}

impl Writer {
    /// Returns the payload of a random message.
    pub fn message(message: &Message, seed: u64, big_endian: bool) -> Vec<u8> {
        let mut writer = Self {
            random: Rng::with_seed(seed),
            big_endian,
            body: Vec::new(),
        };
        writer.fields(message);
        [&[0, u8::from(!big_endian), 0, 0], &*writer.body].concat()
    }

    fn put(&mut self, bytes: &mut [u8]) {
        while !self.body.len().is_multiple_of(bytes.len()) {
            self.body.push(0);
        }
        if self.big_endian {
            bytes.reverse();
        }
        self.body.extend(&*bytes);
    }

    fn length(&mut self, length: usize) {
        self.put(&mut u32::try_from(length).unwrap().to_le_bytes());
    }

    fn fields(&mut self, message: &Message) {
        if message.fields.is_empty() {
            self.body.push(0);
        }
        for field in &message.fields {
            self.value(&field.kind);
        }
    }

    fn value(&mut self, kind: &Type) {
        match kind {
            Type::Number(number) => self.number(*number),
            Type::Text(text) => self.text(*text),
            Type::Message(message) => self.fields(message),
            Type::Array { element, length } => {
                let count = match *length {
                    Length::Fixed(count) => count,
                    Length::Bounded(bound) => self.random.usize(0..=bound.min(3)),
                    Length::Unbounded => self.random.usize(0..=3),
                };
                if !matches!(length, Length::Fixed(_)) {
                    self.length(count);
                }
                for _ in 0..count {
                    self.value(element);
                }
            }
        }
    }

    fn number(&mut self, number: Number) {
        let bits = match number {
            Number::Bool => u64::from(self.random.bool()),
            Number::Float64 if self.random.u8(..4) == 0 => {
                let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0, 5e-324];
                odd[self.random.usize(..odd.len())].to_bits()
            }
            _ => self.random.u64(..),
        };
        self.put(&mut bits.to_le_bytes()[..number.size()]);
    }

    fn text(&mut self, text: Text) {
        assert!(!text.wide, "no known message has wide text");
        let letters = ["a", "_", "\"", "\\", "\n", ",", "é", "∑", "😀", "\u{1}"];
        let count = self.random.usize(0..6);
        let text: String = (0..count)
            .map(|_| letters[self.random.usize(..letters.len())])
            .collect();
        self.length(text.len() + 1);
        self.body.extend(text.bytes().chain([0]));
    }
}
