//! REP-2011 type hashes: SHA-256 of a type's description as JSON.
//!
//! `roslibrust_codegen` 0.26 has them too, but wrong for `byte` fields and for messages within those of an action.

use std::{
    collections::{BTreeMap, btree_map::Entry},
    fmt::Write,
};

use roslibrust_codegen::{ArrayType, FieldInfo, MessageFile};
use sha2::{Digest, Sha256};

use crate::{Messages, type_name};

const NESTED: u8 = 1;

/// What is added to an element's type identifier.
const ARRAY: u8 = 48;
const BOUNDED_SEQUENCE: u8 = 96;
const UNBOUNDED_SEQUENCE: u8 = 144;

/// The hash of a message type, `RIHS01_…`.
pub fn type_hash(message: &MessageFile, messages: &Messages) -> Result<String, String> {
    let mut referenced = BTreeMap::new();
    collect(message, messages, &mut referenced)?;
    let referenced: Vec<String> = referenced.into_values().collect();
    let json = format!(
        r#"{{"type_description": {}, "referenced_type_descriptions": [{}]}}"#,
        description(message, messages)?,
        referenced.join(", ")
    );
    let mut hash = "RIHS01_".to_owned();
    for byte in Sha256::digest(json) {
        write!(hash, "{byte:02x}").map_err(|error| error.to_string())?;
    }
    Ok(hash)
}

/// The descriptions of all messages within a message, by name.
fn collect(
    message: &MessageFile,
    messages: &Messages,
    referenced: &mut BTreeMap<String, String>,
) -> Result<(), String> {
    for field in message.get_fields() {
        if let Some(nested) = nested(field, messages)?
            && let Entry::Vacant(entry) = referenced.entry(type_name(nested)?)
        {
            entry.insert(description(nested, messages)?);
            collect(nested, messages, referenced)?;
        }
    }
    Ok(())
}

fn description(message: &MessageFile, messages: &Messages) -> Result<String, String> {
    let fields = message
        .get_fields()
        .iter()
        .map(|field| field_description(field, messages))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(format!(
        r#"{{"type_name": "{}", "fields": [{}]}}"#,
        type_name(message)?,
        fields.join(", ")
    ))
}

fn field_description(field: &FieldInfo, messages: &Messages) -> Result<String, String> {
    let (element, nested_name) = match nested(field, messages)? {
        Some(message) => (NESTED, type_name(message)?),
        None => (scalar(&field.field_type.field_type)?, String::new()),
    };
    let (offset, capacity) = match field.field_type.array_info {
        ArrayType::NotArray => (0, 0),
        ArrayType::FixedLength(length) => (ARRAY, length),
        ArrayType::Bounded(length) => (BOUNDED_SEQUENCE, length),
        ArrayType::Unbounded => (UNBOUNDED_SEQUENCE, 0),
    };
    if field.field_type.string_capacity.is_some() {
        return Err(format!(
            "{}: bounded strings have no hash here",
            field.field_name
        ));
    }
    Ok(format!(
        r#"{{"name": "{}", "type": {{"type_id": {}, "capacity": {capacity}, "string_capacity": 0, "nested_type_name": "{nested_name}"}}}}"#,
        field.field_name,
        element + offset
    ))
}

fn nested<'a>(
    field: &FieldInfo,
    messages: &'a Messages,
) -> Result<Option<&'a MessageFile>, String> {
    if field.field_type.package_name.is_none() {
        return Ok(None);
    }
    let name = field.get_full_type_name();
    messages
        .get(&name)
        .map(Some)
        .ok_or_else(|| format!("{name} is not vendored"))
}

/// `type_description_interfaces/msg/FieldType`.
fn scalar(ros: &str) -> Result<u8, String> {
    Ok(match ros {
        "int8" => 2,
        "uint8" | "char" => 3,
        "int16" => 4,
        "uint16" => 5,
        "int32" => 6,
        "uint32" => 7,
        "int64" => 8,
        "uint64" => 9,
        "float32" => 10,
        "float64" => 11,
        "bool" => 15,
        "byte" => 16,
        "string" => 17,
        other => return Err(format!("no type identifier for the ROS type {other:?}")),
    })
}
