//! Conversion of values to text: numbers for CSV and JSON, and JSON for values without columns of their own.

use std::fmt::Write;

use crate::cdr::{DecodeError, Reader, Value, Values};
use crate::definition::{Length, Type};

/// Appends a number: the shortest text that parses to the same value, or `NaN`, `inf` or `-inf`.
pub(crate) fn number(text: &mut String, value: Value) {
    // Writing to a string cannot fail.
    let _ = match value {
        Value::Bool(value) => write!(text, "{value}"),
        Value::Int8(value) => write!(text, "{value}"),
        Value::Uint8(value) => write!(text, "{value}"),
        Value::Int16(value) => write!(text, "{value}"),
        Value::Uint16(value) => write!(text, "{value}"),
        Value::Int32(value) => write!(text, "{value}"),
        Value::Uint32(value) => write!(text, "{value}"),
        Value::Int64(value) => write!(text, "{value}"),
        Value::Uint64(value) => write!(text, "{value}"),
        Value::Float32(value) => write!(text, "{value:?}"),
        Value::Float64(value) => write!(text, "{value:?}"),
    };
}

/// Appends bytes as two hexadecimal digits each.
pub(crate) fn octets(text: &mut String, octets: &[u8]) {
    for octet in octets {
        let _ = write!(text, "{octet:02x}");
    }
}

/// Appends a JSON array of numbers.
pub(crate) fn numbers(text: &mut String, values: Values<'_>) {
    list(text, values.iter(), json_number);
}

/// Appends a JSON array of strings.
pub(crate) fn texts<'a>(text: &mut String, texts: impl IntoIterator<Item = &'a str>) {
    list(text, texts, json_text);
}

/// Appends the next value as JSON.
///
/// Byte arrays become hexadecimal strings. Numbers that JSON cannot represent become strings with the text of
/// [`number`].
pub(crate) fn json(
    text: &mut String,
    reader: &mut Reader<'_>,
    kind: &Type,
) -> Result<(), DecodeError> {
    match kind {
        Type::Number(kind) => json_number(text, reader.number(*kind)?),
        Type::Text(kind) => json_text(text, &reader.text(*kind)?),
        Type::Message(message) => {
            reader.open(message)?;
            text.push('{');
            for (index, field) in message.fields.iter().enumerate() {
                if index > 0 {
                    text.push(',');
                }
                json_text(text, &field.name);
                text.push(':');
                json(text, reader, &field.kind).map_err(|error| error.within(&field.name))?;
            }
            text.push('}');
        }
        Type::Array { element, length } => json_array(text, reader, element, *length)?,
    }
    Ok(())
}

/// Appends the next array in the form of [`json`].
pub(crate) fn json_array(
    text: &mut String,
    reader: &mut Reader<'_>,
    element: &Type,
    length: Length,
) -> Result<(), DecodeError> {
    let count = reader.count(length, element)?;
    if let Type::Number(kind) = *element {
        let values = reader.numbers(kind, count)?;
        match values.octets() {
            Some(bytes) => {
                text.push('"');
                octets(text, bytes);
                text.push('"');
            }
            None => numbers(text, values),
        }
        return Ok(());
    }
    text.push('[');
    for index in 0..count {
        if index > 0 {
            text.push(',');
        }
        json(text, reader, element).map_err(|error| error.within(index))?;
    }
    text.push(']');
    Ok(())
}

fn list<T>(text: &mut String, items: impl IntoIterator<Item = T>, append: fn(&mut String, T)) {
    text.push('[');
    for (index, item) in items.into_iter().enumerate() {
        if index > 0 {
            text.push(',');
        }
        append(text, item);
    }
    text.push(']');
}

fn json_number(text: &mut String, value: Value) {
    let finite = match value {
        Value::Float32(value) => value.is_finite(),
        Value::Float64(value) => value.is_finite(),
        _ => true,
    };
    if finite {
        number(text, value);
    } else {
        text.push('"');
        number(text, value);
        text.push('"');
    }
}

fn json_text(text: &mut String, value: &str) {
    let _ = write!(text, "{}", serde_json::Value::from(value));
}
