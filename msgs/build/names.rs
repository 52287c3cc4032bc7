//! How the interfaces are called in ROS 2 and in Rust.

use std::path::Path;

use roslibrust_codegen::MessageFile;

/// The package whose modules lie at the crate's root.
pub const OWN_PACKAGE: &str = "lgvi_msgs";

/// `package/msg/Type`, or `srv` or `action` instead: the folder in which the message's file lies.
pub fn type_name(message: &MessageFile) -> Result<String, String> {
    let (package, name) = (&message.parsed.package, &message.parsed.name);
    Ok(format!("{package}/{}/{name}", kind(message)?))
}

/// `msg`, `srv` or `action`.
pub fn kind(message: &MessageFile) -> Result<String, String> {
    let path = &message.parsed.path;
    path.parent()
        .and_then(Path::file_name)
        .map(|folder| folder.to_string_lossy().into_owned())
        .ok_or_else(|| format!("{} lies in no folder", path.display()))
}

/// `PlanManeuver_SendGoal_Request` is `PlanManeuverSendGoalRequest`.
pub fn rust_name(message: &MessageFile) -> Result<String, String> {
    let name = &message.parsed.name;
    Ok(match kind(message)?.as_str() {
        "msg" => name.clone(),
        _ => name.replace('_', ""),
    })
}

/// Where the generated struct lies.
pub fn rust_path(message: &MessageFile) -> Result<String, String> {
    let (package, name) = (&message.parsed.package, rust_name(message)?);
    Ok(match kind(message)?.as_str() {
        kind if package == OWN_PACKAGE => format!("crate::{kind}::{name}"),
        "msg" => format!("crate::{package}::{name}"),
        kind => format!("crate::{package}::{kind}::{name}"),
    })
}
