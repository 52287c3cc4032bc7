//! Generates the Rust side of the interface packages: a module per ROS package, a struct per `.msg` file.
//!
//! `roslibrust_codegen` parses and hashes the files; the structs are written here, so that they depend on serde alone
//! and carry the `.msg` text as their documentation.

#![allow(
    clippy::print_stdout,
    reason = "cargo reads a build script's standard output"
)]

use std::{
    collections::{BTreeMap, BTreeSet},
    env,
    error::Error,
    fmt::Write,
    fs,
    path::PathBuf,
};

use roslibrust_codegen::{
    ArrayType, FieldInfo, MessageFile, find_and_parse_ros_messages, resolve_dependency_graph,
};

const OWN_PACKAGE: &str = "lgvi_msgs";

/// Module of the crate that holds our own messages: `lgvi_msgs::lgvi_msgs` would stutter.
const OWN_MODULE: &str = "msg";

/// Largest array length that serde and `Default` support by themselves.
const MAX_PLAIN_ARRAY: usize = 32;

/// Hashes of the messages with a `byte` field, which `roslibrust_codegen` 0.26 hashes as if it were a nested message.
const HASHES_WITH_BYTE: [(&str, &str); 2] = [
    (
        "diagnostic_msgs/DiagnosticArray",
        "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    ),
    (
        "diagnostic_msgs/DiagnosticStatus",
        "RIHS01_b0e3e692ea2d54a8af2f4ef1930e81556a2db55216b771f8a7d2724ed47bf0e4",
    ),
];

type Messages = BTreeMap<String, MessageFile>;

fn main() -> Result<(), Box<dyn Error>> {
    for path in ["build.rs", "package.xml", "msg", "vendor"] {
        println!("cargo::rerun-if-changed={path}");
    }
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).canonicalize()?;
    let output = PathBuf::from(env::var("OUT_DIR")?).join("messages.rs");
    fs::write(output, generate(&read_messages(root)?)?)?;
    Ok(())
}

fn read_messages(root: PathBuf) -> Result<Messages, Box<dyn Error>> {
    let (own, vendor) = (root.join("msg"), root.join("vendor"));
    let (mut parsed, _, _) = find_and_parse_ros_messages(&[vendor.clone(), root])?;
    // The crawler takes every file below a package for that package's own.
    parsed.retain(|message| message.package != OWN_PACKAGE || message.path.starts_with(&own));
    let (resolved, _) = resolve_dependency_graph(parsed, Vec::new())?;
    Ok(resolved
        .into_iter()
        .filter(|message| {
            [&own, &vendor]
                .iter()
                .any(|folder| message.parsed.path.starts_with(folder))
        })
        .map(|message| (message.get_full_name(), message))
        .collect())
}

fn generate(messages: &Messages) -> Result<String, Box<dyn Error>> {
    let mut packages: BTreeMap<&str, Vec<&MessageFile>> = BTreeMap::new();
    for message in messages.values() {
        packages
            .entry(&message.parsed.package)
            .or_default()
            .push(message);
    }
    let mut code = String::new();
    for (package, members) in packages {
        writeln!(code, "#[doc = \"ROS package `{package}`.\"]")?;
        writeln!(
            code,
            "#[allow(missing_docs, unused_qualifications, clippy::derivable_impls, reason = \"generated\")]"
        )?;
        writeln!(code, "pub mod {} {{", module(package))?;
        for message in members {
            write_message(&mut code, message, messages)?;
        }
        writeln!(code, "}}")?;
    }
    writeln!(code, "static MESSAGE_TYPES: &[MessageType] = &[")?;
    for message in messages.values() {
        let (module, name) = (module(&message.parsed.package), &message.parsed.name);
        writeln!(code, "MessageType::of::<{module}::{name}>(),")?;
    }
    writeln!(code, "];")?;
    Ok(code)
}

fn write_message(
    code: &mut String,
    message: &MessageFile,
    messages: &Messages,
) -> Result<(), Box<dyn Error>> {
    let name = &message.parsed.name;
    let type_name = format!("{}/msg/{name}", message.parsed.package);
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
        writeln!(code, "pub {}: {},", identifier(field), field_type(field)?)?;
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
    writeln!(code, "const TYPE_HASH: &'static str = {:?};", hash(message))?;
    writeln!(
        code,
        "const DEFINITION: &'static str = {:?};",
        definition(message, messages)?
    )?;
    writeln!(code, "}}")?;
    Ok(())
}

fn module(package: &str) -> &str {
    if package == OWN_PACKAGE {
        OWN_MODULE
    } else {
        package
    }
}

fn identifier(field: &FieldInfo) -> String {
    format!("r#{}", field.field_name)
}

fn field_type(field: &FieldInfo) -> Result<String, Box<dyn Error>> {
    let element = match &field.field_type.package_name {
        Some(package) => format!(
            "crate::{}::{}",
            module(package),
            field.field_type.field_type
        ),
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
            let rust_type = scalar_type(&field.field_type.field_type)?;
            Ok(format!("{value}_{rust_type}"))
        }
        (Some(value), _) => Err(format!(
            "default {value} of the array {:?} is not supported",
            field.field_name
        )),
    }
}

fn hash(message: &MessageFile) -> String {
    HASHES_WITH_BYTE
        .iter()
        .find(|(name, _)| *name == message.get_full_name())
        .map_or_else(
            || message.ros2_hash.to_hash_string(),
            |(_, hash)| (*hash).to_owned(),
        )
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
