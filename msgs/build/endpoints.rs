//! Services and actions as marker types, and the conversions of an action's envelopes.

use std::{error::Error, fmt::Write};

use roslibrust_codegen::MessageFile;

use crate::{
    Messages,
    hash::Descriptions,
    names::rust_name,
    structs::{field_type, identifier},
};

fn write_marker(code: &mut String, type_name: &str, name: &str) -> Result<(), Box<dyn Error>> {
    writeln!(code, "#[doc = \"`{type_name}`\"]")?;
    writeln!(code, "#[derive(Clone, Copy, Debug)]")?;
    writeln!(code, "pub struct {name};")?;
    Ok(())
}

/// Writes a service, whose messages are called after it.
pub fn write_service(
    code: &mut String,
    type_name: &str,
    name: &str,
    descriptions: &Descriptions,
) -> Result<(), Box<dyn Error>> {
    write_marker(code, type_name, name)?;
    writeln!(code, "impl crate::Service for {name} {{")?;
    writeln!(code, "const TYPE_NAME: &'static str = {type_name:?};")?;
    let hash = descriptions.hash(type_name)?;
    writeln!(code, "const TYPE_HASH: &'static str = {hash:?};")?;
    writeln!(code, "type Request = {name}Request;")?;
    writeln!(code, "type Response = {name}Response;")?;
    writeln!(code, "}}")?;
    Ok(())
}

/// Writes an action, whose messages and services are called after it.
pub fn write_action(
    code: &mut String,
    type_name: &str,
    name: &str,
    descriptions: &Descriptions,
) -> Result<(), Box<dyn Error>> {
    write_marker(code, type_name, name)?;
    writeln!(code, "impl crate::Action for {name} {{")?;
    writeln!(code, "const TYPE_NAME: &'static str = {type_name:?};")?;
    let hash = descriptions.hash(type_name)?;
    writeln!(code, "const TYPE_HASH: &'static str = {hash:?};")?;
    for part in [
        "Goal",
        "Result",
        "Feedback",
        "SendGoal",
        "GetResult",
        "FeedbackMessage",
    ] {
        writeln!(code, "type {part} = {name}{part};")?;
    }
    writeln!(code, "}}")?;
    Ok(())
}

/// Conversions between an action's envelopes and the tuple of their fields, or the only field.
pub fn write_conversions(
    code: &mut String,
    message: &MessageFile,
    messages: &Messages,
) -> Result<(), Box<dyn Error>> {
    const ENVELOPES: [&str; 5] = [
        "_SendGoal_Request",
        "_SendGoal_Response",
        "_GetResult_Request",
        "_GetResult_Response",
        "_FeedbackMessage",
    ];
    let parsed = &message.parsed.name;
    if !ENVELOPES.iter().any(|suffix| parsed.ends_with(suffix)) {
        return Ok(());
    }
    let name = rust_name(message)?;
    let fields = message.get_fields();
    let types = fields
        .iter()
        .map(|field| field_type(field, messages))
        .collect::<Result<Vec<_>, _>>()?
        .join(", ");
    let names = fields.iter().map(identifier).collect::<Vec<_>>().join(", ");
    writeln!(
        code,
        "#[allow(unused_parens, reason = \"generated\")] impl From<({types})> for {name} {{ fn from(({names}): ({types})) -> Self {{ Self {{ {names} }} }} }}"
    )?;
    writeln!(
        code,
        "#[allow(unused_parens, reason = \"generated\")] impl From<{name}> for ({types}) {{ fn from({name} {{ {names} }}: {name}) -> Self {{ ({names}) }} }}"
    )?;
    Ok(())
}
