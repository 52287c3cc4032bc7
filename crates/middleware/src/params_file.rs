//! ROS 2 parameter files: which entries are meant for a node, flattened to dotted names.

use serde_yaml_ng::{Mapping, Value};

const PARAMETERS: &str = "ros__parameters";

/// The parameters of `text` meant for the node, in the file's order: later ones win.
pub(crate) fn read(text: &str, node: &str) -> Result<Vec<(String, Value)>, String> {
    let mut found = Vec::new();
    match serde_yaml_ng::from_str(text).map_err(|error| error.to_string())? {
        Value::Null => {}
        Value::Mapping(nodes) => visit_nodes(&nodes, "", node, &mut found)?,
        other => {
            return Err(format!(
                "expected a map of node names, found {}",
                kind(&other)
            ));
        }
    }
    Ok(found)
}

fn visit_nodes(
    map: &Mapping,
    path: &str,
    node: &str,
    found: &mut Vec<(String, Value)>,
) -> Result<(), String> {
    for (key, value) in map {
        let key = key_text(key)?;
        let Value::Mapping(inner) = value else {
            return Err(format!(
                "{key:?}: expected a map with {PARAMETERS:?}, found {}",
                kind(value)
            ));
        };
        if key == PARAMETERS {
            if path.is_empty() {
                return Err(format!("{PARAMETERS:?} stands outside of any node"));
            }
            if matches(path, node) {
                flatten(inner, "", found)?;
            }
        } else {
            let path = format!("{path}/{}", key.trim_matches('/'));
            visit_nodes(inner, &path, node, found)?;
        }
    }
    Ok(())
}

fn flatten(map: &Mapping, prefix: &str, found: &mut Vec<(String, Value)>) -> Result<(), String> {
    for (key, value) in map {
        let name = format!("{prefix}{}", key_text(key)?);
        match value {
            Value::Mapping(inner) => flatten(inner, &format!("{name}."), found)?,
            value => found.push((name, value.clone())),
        }
    }
    Ok(())
}

fn key_text(key: &Value) -> Result<&str, String> {
    key.as_str()
        .filter(|key| !key.is_empty())
        .ok_or_else(|| format!("expected a name, found {}", kind(key)))
}

/// Whether a pattern (`*`: one part, `**`: any number of parts) covers a fully qualified node name.
pub(crate) fn matches(pattern: &str, node: &str) -> bool {
    fn parts(name: &str) -> Vec<&str> {
        name.split('/').filter(|part| !part.is_empty()).collect()
    }
    fn covers(pattern: &[&str], name: &[&str]) -> bool {
        match (pattern, name) {
            ([], []) => true,
            (["**", rest @ ..], _) => {
                (0..=name.len()).any(|skipped| covers(rest, &name[skipped..]))
            }
            (["*", rest @ ..], [_, tail @ ..]) => covers(rest, tail),
            ([first, rest @ ..], [head, tail @ ..]) => first == head && covers(rest, tail),
            _ => false,
        }
    }
    covers(&parts(pattern), &parts(node))
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "nothing",
        Value::Bool(_) => "a bool",
        Value::Number(_) => "a number",
        Value::String(_) => "a string",
        Value::Sequence(_) => "a list",
        Value::Mapping(_) => "a map",
        Value::Tagged(_) => "a tagged value",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wildcards_cover_parts_of_names() {
        assert!(matches("/**", "/a/b"));
        assert!(matches("/**", "/a"));
        assert!(matches("/*", "/a"));
        assert!(!matches("/*", "/a/b"));
        assert!(matches("/**/b", "/a/b"));
        assert!(matches("/**/b", "/b"));
        assert!(matches("b", "/b"));
        assert!(!matches("b", "/a/b"));
        assert!(matches("/a/*/c", "/a/b/c"));
    }

    #[test]
    fn entries_of_the_node_are_flattened_in_order() {
        let text = "
/**:
  ros__parameters: {rate: 1.0, gains: {p: 1, d: 2}}
/a:
  n:
    ros__parameters: {rate: 2.0}
/a/other:
  ros__parameters: {rate: 3.0}
";
        let names: Vec<_> = read(text, "/a/n")
            .unwrap()
            .into_iter()
            .map(|(name, value)| format!("{name}={}", value.as_f64().unwrap()))
            .collect();
        assert_eq!(names, ["rate=1", "gains.p=1", "gains.d=2", "rate=2"]);
    }

    #[test]
    fn malformed_files_say_what_is_wrong() {
        for (text, expected) in [
            ("[1]", "a list"),
            ("a: 1", "a number"),
            ("ros__parameters: {a: 1}", "outside"),
            ("a: [", ""),
        ] {
            let error = read(text, "/n").unwrap_err();
            assert!(error.contains(expected), "{text:?}: {error}");
        }
        assert!(read("", "/n").unwrap().is_empty());
    }
}
