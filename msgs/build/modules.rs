//! The generated code: a module per package and kind of interface, and the tables of all types.

use std::{collections::BTreeMap, error::Error, fmt::Write};

use roslibrust_codegen::MessageFile;

use crate::{
    Messages,
    endpoints::{write_action, write_conversions, write_service},
    hash::Descriptions,
    interfaces::{Action, Interfaces, Service},
    names::{OWN_PACKAGE, kind, rust_path, type_name},
    structs::write_message,
};

/// What a module of the generated code holds.
#[derive(Default)]
struct Members<'a> {
    messages: Vec<&'a MessageFile>,
    services: Vec<&'a Service>,
    actions: Vec<&'a Action>,
}

/// All of the crate that is generated.
pub fn generate(messages: &Messages, interfaces: &Interfaces) -> Result<String, Box<dyn Error>> {
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
    let descriptions = Descriptions::of(messages, interfaces)?;
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
            write_members(&mut code, &members, messages, &descriptions)?;
            if nested {
                writeln!(code, "}}")?;
            }
        }
        if !own {
            writeln!(code, "}}")?;
        }
    }
    write_tables(&mut code, messages, &descriptions)?;
    Ok(code)
}

fn write_tables(
    code: &mut String,
    messages: &Messages,
    descriptions: &Descriptions,
) -> Result<(), Box<dyn Error>> {
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
    writeln!(
        code,
        "/// Calls a macro with the paths of all message types."
    )?;
    writeln!(code, "#[doc(hidden)] #[macro_export]")?;
    writeln!(
        code,
        "macro_rules! for_every_message {{ ($callback:ident) => {{ $callback! {{"
    )?;
    for path in types.values() {
        writeln!(code, "${path},")?;
    }
    writeln!(code, "}} }} }}")?;
    writeln!(code, "static ENDPOINT_TYPES: &[(&str, &str)] = &[")?;
    for name in descriptions.endpoints() {
        writeln!(code, "({name:?}, {:?}),", descriptions.hash(name)?)?;
    }
    writeln!(code, "];")?;
    Ok(())
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
    descriptions: &Descriptions,
) -> Result<(), Box<dyn Error>> {
    for message in &members.messages {
        write_message(code, message, messages, descriptions)?;
        if kind(message)? == "action" {
            write_conversions(code, message, messages)?;
        }
    }
    for Service { package, name } in &members.services {
        write_service(code, &format!("{package}/srv/{name}"), name, descriptions)?;
    }
    for Action { package, name } in &members.actions {
        let type_name = format!("{package}/action/{name}");
        for service in ["SendGoal", "GetResult"] {
            write_service(
                code,
                &format!("{type_name}_{service}"),
                &format!("{name}{service}"),
                descriptions,
            )?;
        }
        write_action(code, &type_name, name, descriptions)?;
    }
    Ok(())
}
