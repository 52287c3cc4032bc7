//! The command lines of nodes: parameters as `-p name:=value` takes them.

use std::fmt::Debug;
use std::path::Path;

/// The command line that sets parameters, each as `name:=value`.
pub(crate) fn ros_arguments(parameters: impl IntoIterator<Item = String>) -> Vec<String> {
    let parameters = parameters
        .into_iter()
        .flat_map(|parameter| ["-p".into(), parameter]);
    std::iter::once("--ros-args".into())
        .chain(parameters)
        .collect()
}

/// A path as a YAML string.
pub(crate) fn path(path: &Path) -> String {
    quoted(&path.display().to_string())
}

/// A parameter that is a text, where it is given.
pub(crate) fn text(name: &str, text: Option<&str>) -> Option<String> {
    text.map(|text| format!("{name}:={}", quoted(text)))
}

/// A parameter that is a number, where it is given.
pub(crate) fn number(name: &str, number: Option<impl Debug>) -> Option<String> {
    number.map(|number| format!("{name}:={number:?}"))
}

/// A parameter that is a list of texts, where it has any.
pub(crate) fn list(name: &str, texts: &[String]) -> Option<String> {
    let list: Vec<String> = texts.iter().map(|text| quoted(text)).collect();
    (!list.is_empty()).then(|| format!("{name}:=[{}]", list.join(", ")))
}

/// A text as a YAML string.
fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "''"))
}
