//! How a topic's values are spread over columns.

use std::sync::Arc;

use super::{LayoutError, MAX_SHAPES};
use crate::definition::{Length, Message, Number, Text, Type};

/// How a value is spread over columns.
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
    /// No message was seen yet.
    Unseen,
    /// All have as many elements; each has its own columns.
    Elements(Vec<Shape>),
    /// One column.
    Whole,
}

/// Makes shapes. Depths count the arrays around a value that are spread.
pub(super) struct Maker {
    elements: usize,
    depth: usize,
    left: usize,
}

impl Maker {
    /// Spreads arrays of up to `elements` elements within less than `depth` others.
    pub fn new(elements: usize, depth: usize) -> Self {
        Self {
            elements,
            depth,
            left: MAX_SHAPES,
        }
    }

    /// Shapes that may still be made.
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

    /// How an array of `count` elements is spread.
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

/// Whether an array of `count` elements may be spread.
pub(super) fn is_spread(element: &Type, count: usize, elements: usize) -> bool {
    *element != Type::Number(Number::Uint8) && (1..=elements).contains(&count)
}

/// Columns of shapes.
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

/// How many arrays within each other are spread.
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

/// Makes arrays within `depth` others one column each.
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
