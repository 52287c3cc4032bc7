//! Which messages a message type has fields of.

use std::collections::BTreeSet;

/// The types that need no definition.
const PRIMITIVE: [&str; 17] = [
    "bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32",
    "uint32", "int64", "uint64", "string", "wstring", "duration", "time",
];

/// Package and type of `package/msg/Type`. The name comes from the network, and leads to files.
pub(crate) fn split(type_name: &str) -> Result<(&str, &str), String> {
    let parts: Vec<&str> = type_name.split('/').collect();
    match *parts {
        [package, "msg", kind] if is_identifier(package) && is_identifier(kind) => {
            Ok((package, kind))
        }
        _ => Err(format!("{type_name:?} is not of the form package/msg/Type")),
    }
}

fn is_identifier(name: &str) -> bool {
    name.starts_with(|first: char| first.is_ascii_alphabetic())
        && name
            .chars()
            .all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
}

/// The messages that a definition has fields of.
pub(crate) fn needed(source: &str, package: &str) -> Result<BTreeSet<(String, String)>, String> {
    let mut needed = BTreeSet::new();
    for line in source.lines() {
        let line = line.split('#').next().unwrap_or_default();
        let Some(field_type) = line.split_whitespace().next() else {
            continue;
        };
        // Without the bounds of arrays and strings.
        let end = field_type.find(['[', '<']).unwrap_or(field_type.len());
        let element = &field_type[..end];
        if PRIMITIVE.contains(&element) {
            continue;
        }
        let (package, kind) = match *element.split('/').collect::<Vec<_>>() {
            [kind] => (package, kind),
            [package, kind] | [package, "msg", kind] => (package, kind),
            _ => return Err(format!("{field_type:?} is no type of a field")),
        };
        if !is_identifier(package) || !is_identifier(kind) {
            return Err(format!("{field_type:?} is no type of a field"));
        }
        needed.insert((package.to_owned(), kind.to_owned()));
    }
    Ok(needed)
}
