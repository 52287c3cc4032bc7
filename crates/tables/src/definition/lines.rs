//! Parser for the lines of a definition.

use std::collections::BTreeSet;

use super::{DefinitionError, Length, Number, Text};

/// The parsed text of one message.
#[derive(Debug)]
pub(super) struct Source {
    /// `pkg/Type`
    pub name: String,
    pub fields: Vec<SourceField>,
}

/// A parsed field. The message types that it names are not resolved yet.
#[derive(Debug)]
pub(super) struct SourceField {
    pub name: String,
    pub base: Base,
    /// The length of an array, or `None` for a single value.
    pub length: Option<Length>,
}

#[derive(Debug)]
pub(super) enum Base {
    Number(Number),
    Text(Text),
    /// `pkg/Type`
    Message(String),
}

/// Prefix of the separator between messages, a line of at least this many `=` and nothing else.
const SEPARATOR: &str = "==========";

/// Returns `pkg/Type` for `pkg/msg/Type` or any other middle part.
pub(super) fn base_name(name: &str) -> String {
    match (name.split_once('/'), name.rsplit_once('/')) {
        (Some((package, _)), Some((_, kind))) => format!("{package}/{kind}"),
        _ => name.to_owned(),
    }
}

/// Returns all messages of a definition, starting with the defined one.
pub(super) fn messages(type_name: &str, text: &str) -> Result<Vec<Source>, DefinitionError> {
    let mut messages = vec![Source {
        name: base_name(type_name),
        fields: Vec::new(),
    }];
    let mut named = true;
    let mut names = BTreeSet::new();
    for (index, line) in text.lines().enumerate() {
        let number = index + 1;
        let line = line.trim();
        if line.starts_with(SEPARATOR) && line.bytes().all(|byte| byte == b'=') {
            named = false;
            continue;
        }
        if !named {
            let Some(name) = line.strip_prefix("MSG:") else {
                return Err(syntax(number, "MSG: and a message's name", line));
            };
            named = true;
            names.clear();
            messages.push(Source {
                name: base_name(name.trim()),
                fields: Vec::new(),
            });
            continue;
        }
        let Some(message) = messages.last_mut() else {
            continue;
        };
        let package = message.name.split('/').next().unwrap_or_default();
        let Some(field) = field(number, line, package)? else {
            continue;
        };
        if !names.insert(field.name.clone()) {
            return Err(DefinitionError::Duplicate {
                line: number,
                name: field.name,
            });
        }
        message.fields.push(field);
    }
    Ok(messages)
}

/// Returns the field defined by a line, or `None` for constants, comments and empty lines.
fn field(number: usize, line: &str, package: &str) -> Result<Option<SourceField>, DefinitionError> {
    if line.is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    let (kind, rest) = line
        .split_once(|character: char| character.is_whitespace())
        .ok_or_else(|| syntax(number, "a type and a name", line))?;
    let rest = rest.trim_start();
    let end = rest
        .find(|character: char| !is_name(character))
        .unwrap_or(rest.len());
    let (name, rest) = rest.split_at(end);
    let (base, length) = type_of(kind, package).ok_or_else(|| syntax(number, "a type", kind))?;
    if !name.starts_with(|character: char| character.is_ascii_alphabetic()) {
        return Err(syntax(number, "a field's name", line));
    }
    let after = rest.trim_start();
    if after.starts_with('=') {
        return Ok(None);
    }
    let comment = after.is_empty() || after.starts_with('#');
    // A default value must be separated by white space. Messages cannot have one.
    if !comment && after.len() == rest.len() {
        return Err(syntax(number, "a field's name", line));
    }
    if !comment && matches!(base, Base::Message(_)) {
        return Err(syntax(number, "the end of the line", after));
    }
    Ok(Some(SourceField {
        name: name.to_owned(),
        base,
        length,
    }))
}

fn type_of(text: &str, package: &str) -> Option<(Base, Option<Length>)> {
    let Some((base, rest)) = text.split_once('[') else {
        return Some((base_of(text, package)?, None));
    };
    let length = match rest.strip_suffix(']')? {
        "" => Length::Unbounded,
        rest => match rest.strip_prefix("<=") {
            Some(bound) => Length::Bounded(bound.parse().ok()?),
            None => Length::Fixed(rest.parse().ok().filter(|length| *length > 0)?),
        },
    };
    Some((base_of(base, package)?, Some(length)))
}

fn base_of(text: &str, package: &str) -> Option<Base> {
    let (name, bound) = match text.split_once("<=") {
        Some((name, bound)) => (name, Some(bound.parse().ok()?)),
        None => (text, None),
    };
    let number = match name {
        "string" => return Some(Base::Text(Text { wide: false, bound })),
        "wstring" => return Some(Base::Text(Text { wide: true, bound })),
        _ if bound.is_some() => return None,
        "bool" => Number::Bool,
        "int8" => Number::Int8,
        "uint8" | "byte" | "char" => Number::Uint8,
        "int16" => Number::Int16,
        "uint16" => Number::Uint16,
        "int32" => Number::Int32,
        "uint32" => Number::Uint32,
        "int64" => Number::Int64,
        "uint64" => Number::Uint64,
        "float32" => Number::Float32,
        "float64" => Number::Float64,
        name if name.split('/').all(is_word) => {
            return Some(Base::Message(if name.contains('/') {
                base_name(name)
            } else {
                format!("{package}/{name}")
            }));
        }
        _ => return None,
    };
    Some(Base::Number(number))
}

fn is_word(text: &str) -> bool {
    !text.is_empty() && text.chars().all(is_name)
}

fn is_name(character: char) -> bool {
    character.is_ascii_alphanumeric() || character == '_'
}

fn syntax(line: usize, expected: &'static str, found: &str) -> DefinitionError {
    DefinitionError::Syntax {
        line,
        expected,
        found: found.chars().take(80).collect(),
    }
}
