//! Distribution of a topic's values over columns.

use std::sync::Arc;

use super::{LayoutError, MAX_SHAPES};
use crate::definition::{Length, Message, Number, Text, Type};

/// Distribution of a value over columns.
pub(super) enum Shape {
    Number(Number),
    Text(Text),
    Message(Arc<Message>, Vec<Shape>),
    Array {
        element: Type,
        length: Length,
        spread: Spread,
    },
}

pub(super) enum Spread {
    /// No message has been observed yet.
    Unseen,
    /// All arrays so far have the same length. Each element has its own columns.
    Elements(Vec<Shape>),
    /// The array has a single column.
    Whole,
}

/// Creates shapes. Depths count the spread arrays around a value.
pub(super) struct Maker {
    elements: usize,
    depth: usize,
    left: usize,
}

impl Maker {
    /// Creates a maker that spreads arrays of up to `elements` elements within fewer than `depth` others.
    pub fn new(elements: usize, depth: usize) -> Self {
        Self {
            elements,
            depth,
            left: MAX_SHAPES,
        }
    }

    /// Returns the number of shapes that may still be created.
    pub fn left(&self) -> usize {
        self.left
    }

    pub fn fields(&mut self, message: &Message, depth: usize) -> Result<Vec<Shape>, LayoutError> {
        let fields = message.fields.iter();
        fields.map(|field| self.shape(&field.kind, depth)).collect()
    }

    fn shape(&mut self, kind: &Type, depth: usize) -> Result<Shape, LayoutError> {
        self.left = self.left.checked_sub(1).ok_or(LayoutError::TooWide)?;
        Ok(match kind {
            Type::Number(number) => Shape::Number(*number),
            Type::Text(text) => Shape::Text(*text),
            Type::Message(message) => {
                Shape::Message(Arc::clone(message), self.fields(message, depth)?)
            }
            Type::Array { element, length } => Shape::Array {
                element: (**element).clone(),
                length: *length,
                spread: match (&**element, *length) {
                    (Type::Number(Number::Uint8), _) => Spread::Whole,
                    _ if depth >= self.depth => Spread::Whole,
                    (element, Length::Fixed(count)) => self.spread(element, count, depth)?,
                    _ => Spread::Unseen,
                },
            },
        })
    }

    /// Returns the distribution of an array of `count` elements.
    pub fn spread(
        &mut self,
        element: &Type,
        count: usize,
        depth: usize,
    ) -> Result<Spread, LayoutError> {
        if !is_spread(element, count, self.elements) {
            return Ok(Spread::Whole);
        }
        let elements = (0..count).map(|_| self.shape(element, depth + 1));
        Ok(Spread::Elements(elements.collect::<Result<_, _>>()?))
    }
}

/// Returns true if an array of `count` elements may be spread.
pub(super) fn is_spread(element: &Type, count: usize, elements: usize) -> bool {
    *element != Type::Number(Number::Uint8) && (1..=elements).contains(&count)
}

/// Returns the number of columns of the shapes.
pub(super) fn count(shapes: &[Shape]) -> usize {
    let columns = shapes.iter().map(|shape| match shape {
        Shape::Number(_) | Shape::Text(_) => 1,
        Shape::Message(_, shapes) => count(shapes),
        Shape::Array { spread, .. } => match spread {
            Spread::Elements(shapes) => count(shapes),
            Spread::Unseen | Spread::Whole => 1,
        },
    });
    columns.sum()
}

/// Returns the maximum number of nested spread arrays.
pub(super) fn depth(shapes: &[Shape]) -> usize {
    let depths = shapes.iter().map(|shape| match shape {
        Shape::Message(_, shapes) => depth(shapes),
        Shape::Array {
            spread: Spread::Elements(shapes),
            ..
        } => 1 + depth(shapes),
        Shape::Number(_) | Shape::Text(_) | Shape::Array { .. } => 0,
    });
    depths.max().unwrap_or(0)
}

/// Reduces arrays within `depth` others to a single column each.
pub(super) fn collapse(shapes: &mut [Shape], depth: usize) {
    for shape in shapes {
        match shape {
            Shape::Number(_) | Shape::Text(_) => {}
            Shape::Message(_, shapes) => collapse(shapes, depth),
            Shape::Array { spread, .. } => match (depth.checked_sub(1), spread) {
                (None, spread) => *spread = Spread::Whole,
                (Some(depth), Spread::Elements(shapes)) => collapse(shapes, depth),
                (Some(_), Spread::Unseen | Spread::Whole) => {}
            },
        }
    }
}
