//! Generates the Rust side of the interface packages: a module per ROS package, a struct per `.msg` file and per message
//! of a `.srv` or `.action` file.
//!
//! `roslibrust_codegen` parses the files; the structs are written here, so that they depend on serde alone and carry the
//! `.msg` text as their documentation.

#![allow(
    clippy::print_stdout,
    reason = "cargo reads a build script's standard output"
)]

mod definition;
mod endpoints;
mod hash;
mod interfaces;
mod modules;
mod names;
mod structs;

use std::{
    collections::BTreeMap,
    env,
    error::Error,
    fs, io,
    path::{Path, PathBuf},
};

use roslibrust_codegen::{
    ArrayType, FieldInfo, FieldType, MessageFile, find_and_parse_ros_messages,
    resolve_dependency_graph,
};

use interfaces::Interfaces;
use names::OWN_PACKAGE;

/// Messages by their full names, `package/Type`.
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
        modules::generate(&messages, &interfaces)?,
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
    for message in &mut parsed {
        if message.fields.is_empty() {
            message.fields.push(only_field(&message.package));
        }
    }
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

/// What ROS 2 gives a message that has no fields.
fn only_field(package: &str) -> FieldInfo {
    FieldInfo {
        field_type: FieldType {
            package_name: None,
            source_package: package.to_owned(),
            field_type: "uint8".to_owned(),
            array_info: ArrayType::NotArray,
            string_capacity: None,
        },
        field_name: "structure_needs_at_least_one_member".to_owned(),
        default: None,
    }
}
