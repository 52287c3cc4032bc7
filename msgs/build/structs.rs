//! A message as a Rust struct.

use std::{error::Error, fmt::Write};

use roslibrust_codegen::{ArrayType, FieldInfo, MessageFile};

use crate::{
    Messages,
    definition::definition,
    hash::Descriptions,
    names::{rust_name, rust_path, type_name},
};

/// Largest array length that serde and `Default` support by themselves.
const MAX_PLAIN_ARRAY: usize = 32;

/// Writes the struct, its default, its constants and its `RosMessage`.
pub fn write_message(
    code: &mut String,
    message: &MessageFile,
    messages: &Messages,
    descriptions: &Descriptions,
) -> Result<(), Box<dyn Error>> {
    let name = rust_name(message)?;
    let type_name = type_name(message)?;
    let documentation = format!(
        "`{type_name}`:\n```text\n{}\n```",
        message.parsed.source.trim()
    );

    writeln!(code, "#[doc = {documentation:?}]")?;
    writeln!(
        code,
        "#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]"
    )?;
    writeln!(code, "pub struct {name} {{")?;
    for field in message.get_fields() {
        if matches!(field.field_type.array_info, ArrayType::FixedLength(length) if length > MAX_PLAIN_ARRAY)
        {
            writeln!(code, "#[serde(with = \"serde_big_array::BigArray\")]")?;
        }
        writeln!(
            code,
            "pub {}: {},",
            identifier(field),
            field_type(field, messages)?
        )?;
    }
    writeln!(code, "}}")?;

    writeln!(
        code,
        "impl Default for {name} {{ fn default() -> Self {{ Self {{"
    )?;
    for field in message.get_fields() {
        writeln!(code, "{}: {},", identifier(field), default_value(field)?)?;
    }
    writeln!(code, "}} }} }}")?;

    if !message.get_constants().is_empty() {
        writeln!(code, "impl {name} {{")?;
        for constant in message.get_constants() {
            let rust_type = scalar_type(&constant.constant_type)?;
            let (name, value) = (&constant.constant_name, &constant.constant_value);
            writeln!(code, "pub const {name}: {rust_type} = {value};")?;
        }
        writeln!(code, "}}")?;
    }

    writeln!(code, "impl crate::RosMessage for {name} {{")?;
    writeln!(code, "const TYPE_NAME: &'static str = {type_name:?};")?;
    writeln!(
        code,
        "const TYPE_HASH: &'static str = {:?};",
        descriptions.hash(&type_name)?
    )?;
    writeln!(
        code,
        "const DEFINITION: &'static str = {:?};",
        definition(message, messages)?
    )?;
    writeln!(code, "}}")?;
    Ok(())
}

pub fn identifier(field: &FieldInfo) -> String {
    format!("r#{}", field.field_name)
}

pub fn field_type(field: &FieldInfo, messages: &Messages) -> Result<String, Box<dyn Error>> {
    let element = match &field.field_type.package_name {
        Some(_) => {
            let name = field.get_full_type_name();
            let message = messages
                .get(&name)
                .ok_or_else(|| format!("{name} is not vendored"))?;
            rust_path(message)?
        }
        None => scalar_type(&field.field_type.field_type)?.to_owned(),
    };
    Ok(match field.field_type.array_info {
        ArrayType::NotArray => element,
        ArrayType::FixedLength(length) => format!("[{element}; {length}]"),
        ArrayType::Bounded(_) | ArrayType::Unbounded => format!("Vec<{element}>"),
    })
}

fn scalar_type(ros: &str) -> Result<&'static str, String> {
    Ok(match ros {
        "bool" => "bool",
        "byte" | "char" | "uint8" => "u8",
        "int8" => "i8",
        "int16" => "i16",
        "uint16" => "u16",
        "int32" => "i32",
        "uint32" => "u32",
        "int64" => "i64",
        "uint64" => "u64",
        "float32" => "f32",
        "float64" => "f64",
        "string" => "::std::string::String",
        other => return Err(format!("no Rust type for the ROS type {other:?}")),
    })
}

fn default_value(field: &FieldInfo) -> Result<String, String> {
    match (&field.default, &field.field_type.array_info) {
        (None, ArrayType::FixedLength(length)) => Ok(format!("[Default::default(); {length}]")),
        (None, _) => Ok("Default::default()".to_owned()),
        (Some(value), ArrayType::NotArray) => {
            Ok(match scalar_type(&field.field_type.field_type)? {
                "bool" => value.to_string(),
                number => format!("{value}_{number}"),
            })
        }
        (Some(value), _) => Err(format!(
            "default {value} of the array {:?} is not supported",
            field.field_name
        )),
    }
}
