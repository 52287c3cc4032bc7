//! Names and kinds of columns.

use super::shape::{Shape, Spread};
use super::{Column, Kind};
use crate::definition::{Message, Number, Type};

pub(super) fn append_fields(
    prefix: &str,
    message: &Message,
    shapes: &[Shape],
    columns: &mut Vec<Column>,
) {
    for (field, shape) in message.fields.iter().zip(shapes) {
        append(format!("{prefix}{}", field.name), shape, columns);
    }
}

fn append(name: String, shape: &Shape, columns: &mut Vec<Column>) {
    let kind = match shape {
        Shape::Number(number) => Kind::Number(*number),
        Shape::Text(_) => Kind::Text,
        Shape::Message(message, shapes) => {
            return append_fields(&format!("{name}."), message, shapes, columns);
        }
        Shape::Array {
            spread: Spread::Elements(shapes),
            ..
        } => {
            for (index, shape) in shapes.iter().enumerate() {
                append(format!("{name}.{index}"), shape, columns);
            }
            return;
        }
        Shape::Array { element, .. } => match element {
            Type::Number(Number::Uint8) => Kind::Octets,
            Type::Number(number) => Kind::Numbers(*number),
            Type::Text(_) => Kind::Texts,
            Type::Message(_) | Type::Array { .. } => Kind::Json,
        },
    };
    columns.push(Column { name, kind });
}
