//! Array lengths observed in messages.

use super::LayoutError;
use super::shape::{Maker, Shape, Spread, is_spread};
use crate::cdr::{DecodeError, Reader};
use crate::definition::{Message, Type};

/// Number of shapes of a message, by the number of spread arrays around them. It is determined before any shapes are
/// created.
pub(super) struct Sizes {
    elements: usize,
    /// Arrays within this many others are not spread.
    depth: usize,
    shapes: Vec<usize>,
}

impl Sizes {
    /// Counts the shapes of a message, and checks the whole message.
    pub fn of(
        message: &Message,
        payload: &[u8],
        elements: usize,
        depth: usize,
    ) -> Result<Self, DecodeError> {
        let mut sizes = Self {
            elements,
            depth,
            shapes: Vec::new(),
        };
        let mut reader = Reader::new(payload)?;
        sizes.add_fields(message, 0, &mut reader)?;
        reader.finish()?;
        Ok(sizes)
    }

    /// Returns the depth to which arrays may be spread so that there are at most `limit` shapes.
    pub fn depth_within(&self, limit: usize) -> usize {
        let mut left = limit;
        for (depth, shapes) in self.shapes.iter().enumerate() {
            match left.checked_sub(*shapes) {
                Some(rest) => left = rest,
                None => return depth.saturating_sub(1),
            }
        }
        self.depth
    }

    fn count(&mut self, depth: usize, shapes: usize) {
        if self.shapes.len() <= depth {
            self.shapes.resize(depth + 1, 0);
        }
        self.shapes[depth] += shapes;
    }

    fn add_fields(
        &mut self,
        message: &Message,
        depth: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), DecodeError> {
        reader.open(message)?;
        for field in &message.fields {
            self.add(&field.kind, depth, reader)
                .map_err(|error| error.within(&field.name))?;
        }
        Ok(())
    }

    fn add(
        &mut self,
        kind: &Type,
        depth: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), DecodeError> {
        self.count(depth, 1);
        match kind {
            Type::Number(number) => reader.number(*number).map(drop)?,
            Type::Text(text) => reader.text(*text).map(drop)?,
            Type::Message(message) => self.add_fields(message, depth, reader)?,
            Type::Array { element, length } => {
                let count = reader.count(*length, element)?;
                let is_spread = depth < self.depth && is_spread(element, count, self.elements);
                match &**element {
                    Type::Number(number) => {
                        reader.numbers(*number, count)?;
                        self.count(depth + 1, if is_spread { count } else { 0 });
                    }
                    element if is_spread => {
                        for index in 0..count {
                            self.add(element, depth + 1, reader)
                                .map_err(|error| error.within(index))?;
                        }
                    }
                    element => reader.skip_elements(element, count)?,
                }
            }
        }
        Ok(())
    }
}

/// Updates shapes with the array lengths of a message. [`Sizes`] has already checked the message.
impl Maker {
    pub fn observe_fields(
        &mut self,
        message: &Message,
        shapes: &mut [Shape],
        depth: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), LayoutError> {
        reader.open(message).map_err(DecodeError::from)?;
        for shape in shapes {
            self.observe(shape, depth, reader)?;
        }
        Ok(())
    }

    fn observe(
        &mut self,
        shape: &mut Shape,
        depth: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), LayoutError> {
        match shape {
            Shape::Number(number) => {
                reader.number(*number).map_err(DecodeError::from)?;
            }
            Shape::Text(text) => {
                reader.text(*text).map_err(DecodeError::from)?;
            }
            Shape::Message(message, shapes) => {
                self.observe_fields(message, shapes, depth, reader)?;
            }
            Shape::Array {
                element,
                length,
                spread,
            } => {
                let count = reader.count(*length, element).map_err(DecodeError::from)?;
                if matches!(spread, Spread::Unseen) {
                    *spread = self.spread(element, count, depth)?;
                }
                match spread {
                    Spread::Elements(shapes) if shapes.len() == count => {
                        for shape in shapes {
                            self.observe(shape, depth + 1, reader)?;
                        }
                    }
                    _ => {
                        *spread = Spread::Whole;
                        reader.skip_elements(element, count)?;
                    }
                }
            }
        }
        Ok(())
    }
}
