//! Generates the Rust side of the interface packages: a module per ROS package, a struct per `.msg` file and per message
//! of a `.srv` or `.action` file.
//!
//! `roslibrust_codegen` parses the files; the structs are written here, so that they depend on serde alone and carry the
//! `.msg` text as their documentation.

#![allow(
    clippy::print_stdout,
    reason = "cargo reads a build script's standard output"
)]

mod hash;
mod interfaces;

use std::{
    collections::{BTreeMap, BTreeSet},
    env,
    error::Error,
    fmt::Write,
    fs, io,
    path::{Path, PathBuf},
};

use roslibrust_codegen::{
    ArrayType, FieldInfo, MessageFile, find_and_parse_ros_messages, resolve_dependency_graph,
};

use interfaces::{Action, Interfaces, Service};

const OWN_PACKAGE: &str = "lgvi_msgs";

/// Largest array length that serde and `Default` support by themselves.
const MAX_PLAIN_ARRAY: usize = 32;

type Messages = BTreeMap<String, MessageFile>;

fn main() -> Result<(), Box<dyn Error>> {
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).canonicalize()?;
    // A path that is missing would have this run at every build; a first file in it must be in CMakeLists.txt too.
    let inputs = [
        "CMakeLists.txt",
        "build",
        "package.xml",
        "msg",
        "srv",
        "action",
        "vendor",
    ];
    for path in inputs.iter().filter(|path| root.join(path).exists()) {
        println!("cargo::rerun-if-changed={path}");
    }
    let output = PathBuf::from(env::var("OUT_DIR")?).canonicalize()?;
    let expanded = output.join("interfaces");
    let interfaces = expand_interfaces(&root, &expanded)?;
    let messages = read_messages(&root, &expanded)?;
    fs::write(
        output.join("messages.rs"),
        generate(&messages, &interfaces)?,
    )?;
    Ok(())
}

fn expand_interfaces(root: &Path, expanded: &Path) -> Result<Interfaces, Box<dyn Error>> {
    if expanded.exists() {
        fs::remove_dir_all(expanded)?;
    }
    fs::create_dir_all(expanded)?;
    let mut interfaces = Interfaces::default();
    interfaces.expand(OWN_PACKAGE, root, expanded)?;
    let mut vendored = fs::read_dir(root.join("vendor"))?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<io::Result<Vec<_>>>()?;
    vendored.sort();
    for package in vendored.iter().filter(|path| path.is_dir()) {
        let name = package.file_name().unwrap_or_default().to_string_lossy();
        interfaces.expand(&name, package, expanded)?;
    }
    Ok(interfaces)
}

fn read_messages(root: &Path, expanded: &Path) -> Result<Messages, Box<dyn Error>> {
    let (own, vendor) = (root.join("msg"), root.join("vendor"));
    let (mut parsed, _, _) = find_and_parse_ros_messages(&[vendor.clone(), root.to_owned()])?;
    // The crawler takes every file below a package for that package's own.
    parsed.retain(|message| message.package != OWN_PACKAGE || message.path.starts_with(&own));
    parsed.extend(find_and_parse_ros_messages(&[expanded.to_owned()])?.0);
    let (resolved, _) = resolve_dependency_graph(parsed, Vec::new())?;
    Ok(resolved
        .into_iter()
        .filter(|message| {
            [&own, &vendor, &expanded.to_owned()]
                .iter()
                .any(|folder| message.parsed.path.starts_with(folder))
        })
        .map(|message| (message.get_full_name(), message))
        .collect())
}

/// What a module of the generated code holds.
#[derive(Default)]
struct Members<'a> {
    messages: Vec<&'a MessageFile>,
    services: Vec<&'a Service>,
    actions: Vec<&'a Action>,
}

fn generate(messages: &Messages, interfaces: &Interfaces) -> Result<String, Box<dyn Error>> {
    let mut packages: BTreeMap<&str, BTreeMap<String, Members<'_>>> = BTreeMap::new();
    for message in messages.values() {
        let package = packages.entry(&message.parsed.package).or_default();
        let members = package.entry(kind(message)?).or_default();
        members.messages.push(message);
    }
    for service in &interfaces.services {
        let package = packages.entry(&service.package).or_default();
        let members = package.entry("srv".to_owned()).or_default();
        members.services.push(service);
    }
    for action in &interfaces.actions {
        let package = packages.entry(&action.package).or_default();
        let members = package.entry("action".to_owned()).or_default();
        members.actions.push(action);
    }
    let mut code = String::new();
    for (package, kinds) in packages {
        let own = package == OWN_PACKAGE;
        if !own {
            open_module(&mut code, package, &format!("ROS package `{package}`."))?;
        }
        for (kind, members) in kinds {
            let nested = own || kind != "msg";
            if nested {
                open_module(
                    &mut code,
                    &kind,
                    &format!("ROS interfaces `{package}/{kind}`."),
                )?;
            }
            write_members(&mut code, &members, messages)?;
            if nested {
                writeln!(code, "}}")?;
            }
        }
        if !own {
            writeln!(code, "}}")?;
        }
    }
    let mut types = BTreeMap::new();
    for message in messages.values() {
        types.insert(type_name(message)?, rust_path(message)?);
    }
    writeln!(
        code,
        "#[allow(unused_qualifications, reason = \"generated\")]"
    )?;
    writeln!(code, "static MESSAGE_TYPES: &[MessageType] = &[")?;
    for path in types.values() {
        writeln!(code, "MessageType::of::<{path}>(),")?;
    }
    writeln!(code, "];")?;
    Ok(code)
}

fn open_module(code: &mut String, name: &str, documentation: &str) -> Result<(), Box<dyn Error>> {
    writeln!(code, "#[doc = {documentation:?}]")?;
    writeln!(
        code,
        "#[allow(missing_docs, unused_qualifications, clippy::derivable_impls, reason = \"generated\")]"
    )?;
    writeln!(code, "pub mod {name} {{")?;
    Ok(())
}

fn write_members(
    code: &mut String,
    members: &Members<'_>,
    messages: &Messages,
) -> Result<(), Box<dyn Error>> {
    for message in &members.messages {
        write_message(code, message, messages)?;
        if kind(message)? == "action" {
            write_conversions(code, message, messages)?;
        }
    }
    for Service { package, name } in &members.services {
        write_service(code, &format!("{package}/srv/{name}"), name)?;
    }
    for Action { package, name } in &members.actions {
        let type_name = format!("{package}/action/{name}");
        for service in ["SendGoal", "GetResult"] {
            write_service(
                code,
                &format!("{type_name}_{service}"),
                &format!("{name}{service}"),
            )?;
        }
        write_action(code, &type_name, name)?;
    }
    Ok(())
}

fn write_marker(code: &mut String, type_name: &str, name: &str) -> Result<(), Box<dyn Error>> {
    writeln!(code, "#[doc = \"`{type_name}`\"]")?;
    writeln!(code, "#[derive(Clone, Copy, Debug)]")?;
    writeln!(code, "pub struct {name};")?;
    Ok(())
}

fn write_service(code: &mut String, type_name: &str, name: &str) -> Result<(), Box<dyn Error>> {
    write_marker(code, type_name, name)?;
    writeln!(code, "impl crate::Service for {name} {{")?;
    writeln!(code, "const TYPE_NAME: &'static str = {type_name:?};")?;
    writeln!(code, "type Request = {name}Request;")?;
    writeln!(code, "type Response = {name}Response;")?;
    writeln!(code, "}}")?;
    Ok(())
}

fn write_action(code: &mut String, type_name: &str, name: &str) -> Result<(), Box<dyn Error>> {
    write_marker(code, type_name, name)?;
    writeln!(code, "impl crate::Action for {name} {{")?;
    writeln!(code, "const TYPE_NAME: &'static str = {type_name:?};")?;
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
fn write_conversions(
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

fn write_message(
    code: &mut String,
    message: &MessageFile,
    messages: &Messages,
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
        hash::type_hash(message, messages)?
    )?;
    writeln!(
        code,
        "const DEFINITION: &'static str = {:?};",
        definition(message, messages)?
    )?;
    writeln!(code, "}}")?;
    Ok(())
}

/// `package/msg/Type`, or `srv` or `action` instead: the folder in which the message's file lies.
fn type_name(message: &MessageFile) -> Result<String, String> {
    let (package, name) = (&message.parsed.package, &message.parsed.name);
    Ok(format!("{package}/{}/{name}", kind(message)?))
}

fn kind(message: &MessageFile) -> Result<String, String> {
    let path = &message.parsed.path;
    path.parent()
        .and_then(Path::file_name)
        .map(|folder| folder.to_string_lossy().into_owned())
        .ok_or_else(|| format!("{} lies in no folder", path.display()))
}

/// `PlanManeuver_SendGoal_Request` is `PlanManeuverSendGoalRequest`.
fn rust_name(message: &MessageFile) -> Result<String, String> {
    let name = &message.parsed.name;
    Ok(match kind(message)?.as_str() {
        "msg" => name.clone(),
        _ => name.replace('_', ""),
    })
}

fn rust_path(message: &MessageFile) -> Result<String, String> {
    let (package, name) = (&message.parsed.package, rust_name(message)?);
    Ok(match kind(message)?.as_str() {
        kind if package == OWN_PACKAGE => format!("crate::{kind}::{name}"),
        "msg" => format!("crate::{package}::{name}"),
        kind => format!("crate::{package}::{kind}::{name}"),
    })
}

fn identifier(field: &FieldInfo) -> String {
    format!("r#{}", field.field_name)
}

fn field_type(field: &FieldInfo, messages: &Messages) -> Result<String, Box<dyn Error>> {
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

/// The text rosbag2 stores: the message, then each message it needs once, depth first, in alphabetical order.
fn definition(message: &MessageFile, messages: &Messages) -> Result<String, Box<dyn Error>> {
    fn append(
        text: &mut String,
        seen: &mut BTreeSet<String>,
        message: &MessageFile,
        messages: &Messages,
    ) -> Result<(), Box<dyn Error>> {
        text.push_str(&message.parsed.source);
        let nested = message
            .get_fields()
            .iter()
            .filter(|field| field.field_type.package_name.is_some());
        for name in nested
            .map(FieldInfo::get_full_type_name)
            .collect::<BTreeSet<_>>()
        {
            if seen.insert(name.clone()) {
                let dependency = messages
                    .get(&name)
                    .ok_or_else(|| format!("{name} is not vendored"))?;
                write!(text, "\n{}\nMSG: {name}\n", "=".repeat(80))?;
                append(text, seen, dependency, messages)?;
            }
        }
        Ok(())
    }
    let mut text = String::new();
    append(&mut text, &mut BTreeSet::new(), message, messages)?;
    Ok(text)
}
