//! Distribution of a message's values over the columns.

use super::Cell;
use super::shape::{Shape, Spread};
use crate::cdr::{DecodeError, Fault, Reader};
use crate::definition::{Length, Message, Type};
use crate::text;

pub(super) fn append_fields<'a>(
    message: &Message,
    shapes: &[Shape],
    reader: &mut Reader<'a>,
    cells: &mut Vec<Cell<'a>>,
) -> Result<(), DecodeError> {
    reader.open(message)?;
    for (field, shape) in message.fields.iter().zip(shapes) {
        append(shape, reader, cells).map_err(|error| error.within(&field.name))?;
    }
    Ok(())
}

fn append<'a>(
    shape: &Shape,
    reader: &mut Reader<'a>,
    cells: &mut Vec<Cell<'a>>,
) -> Result<(), DecodeError> {
    let cell = match shape {
        Shape::Number(number) => Cell::Number(reader.number(*number)?),
        Shape::Text(text) => Cell::Text(reader.text(*text)?),
        Shape::Message(message, shapes) => return append_fields(message, shapes, reader, cells),
        Shape::Array {
            element,
            length,
            spread,
        } => {
            if let Spread::Elements(shapes) = spread {
                let count = reader.count(*length, element)?;
                if count != shapes.len() {
                    return Err(Fault::Length {
                        found: count,
                        expected: shapes.len(),
                    }
                    .into());
                }
                for (index, shape) in shapes.iter().enumerate() {
                    append(shape, reader, cells).map_err(|error| error.within(index))?;
                }
                return Ok(());
            }
            whole(element, *length, reader)?
        }
    };
    cells.push(cell);
    Ok(())
}

/// Reads an array that has a single column.
fn whole<'a>(
    element: &Type,
    length: Length,
    reader: &mut Reader<'a>,
) -> Result<Cell<'a>, DecodeError> {
    match element {
        Type::Number(number) => {
            let count = reader.count(length, element)?;
            let values = reader.numbers(*number, count)?;
            Ok(values.octets().map_or(Cell::Numbers(values), Cell::Octets))
        }
        Type::Text(text) => {
            let count = reader.count(length, element)?;
            let texts = (0..count).map(|_| reader.text(*text));
            Ok(Cell::Texts(texts.collect::<Result<_, _>>()?))
        }
        Type::Message(_) | Type::Array { .. } => {
            let mut text = String::new();
            text::json_array(&mut text, reader, element, length)?;
            Ok(Cell::Json(text))
        }
    }
}
