//! ROS 2 parameter files: which entries are meant for a node, flattened to dotted names.

use std::collections::BTreeSet;

use crate::{
    ParameterValue, names,
    yaml::{self, Content, Node},
};

const PARAMETERS: &str = "ros__parameters";

/// The parameters of `text` meant for the node, in the file's order: later ones win. The values of all nodes are
/// checked, whomever they are meant for.
pub(crate) fn read(text: &str, node: &str) -> Result<Vec<(String, ParameterValue)>, String> {
    let mut found = Vec::new();
    for document in yaml::documents(text)? {
        match document.content {
            Content::Nothing => {}
            Content::Map(nodes) => visit_nodes(nodes, "", node, &mut found)?,
            other => return Err(format!("expected a map of nodes, found {}", other.kind())),
        }
    }
    Ok(found)
}

fn visit_nodes(
    entries: Vec<(String, Node)>,
    path: &str,
    node: &str,
    found: &mut Vec<(String, ParameterValue)>,
) -> Result<(), String> {
    for (key, Node { line, content }) in entries {
        let Content::Map(inner) = content else {
            let kind = content.kind();
            let expected = if key == PARAMETERS {
                "a map of parameters".into()
            } else {
                format!("a map with {PARAMETERS:?}")
            };
            return Err(format!(
                "line {line}: {key:?}: expected {expected}, found {kind}"
            ));
        };
        if key == PARAMETERS {
            if path.is_empty() {
                return Err(format!(
                    "line {line}: {PARAMETERS:?} stands outside of any node"
                ));
            }
            let mut parameters = Vec::new();
            flatten(inner, "", &mut parameters)
                .map_err(|reason| format!("{reason} (of node {path:?})"))?;
            if matches(path, node) {
                found.append(&mut parameters);
            }
        } else {
            let path = extend(path, &key).map_err(|reason| format!("line {line}: {reason}"))?;
            visit_nodes(inner, &path, node, found)?;
        }
    }
    Ok(())
}

/// Appends a key to a node's path. Only the outermost key may begin with a slash.
fn extend(path: &str, key: &str) -> Result<String, String> {
    let relative = if path.is_empty() {
        key.strip_prefix('/').unwrap_or(key)
    } else {
        key
    };
    let wild = |token| matches!(token, "*" | "**") || names::is_token(token);
    if relative.split('/').all(wild) {
        Ok(format!("{path}/{relative}"))
    } else {
        Err(format!(
            "{key:?} is not a node: names and the wildcards \"*\" and \"**\" are separated by single slashes"
        ))
    }
}

fn flatten(
    entries: Vec<(String, Node)>,
    prefix: &str,
    found: &mut Vec<(String, ParameterValue)>,
) -> Result<(), String> {
    for (key, node) in entries {
        let (name, line) = (format!("{prefix}{key}"), node.line);
        if key.is_empty() {
            return Err(format!("line {line}: a parameter without a name"));
        }
        match node.content {
            Content::Map(inner) => flatten(inner, &format!("{name}."), found)?,
            content => {
                let value = yaml::parameter(Node { line, content })
                    .map_err(|reason| format!("line {line}: parameter {name:?}: {reason}"))?;
                found.push((name, value));
            }
        }
    }
    Ok(())
}

/// Whether a pattern (`*`: one part, `**`: any number of parts) covers a fully qualified node name.
fn matches(pattern: &str, node: &str) -> bool {
    fn parts(name: &str) -> Vec<&str> {
        name.split('/').filter(|part| !part.is_empty()).collect()
    }
    let node = parts(node);
    // How many of the node's parts the pattern so far may cover.
    let mut covered = BTreeSet::from([0]);
    for part in parts(pattern) {
        let any = part == "**";
        let next = |count: usize| {
            let one = node.get(count).filter(|name| part == "*" || part == **name);
            one.map(|_| count + 1)
        };
        covered = match covered.first() {
            Some(&least) if any => (least..=node.len()).collect(),
            _ => covered.into_iter().filter_map(next).collect(),
        };
    }
    covered.contains(&node.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, node: &str) -> Vec<String> {
        read(text, node)
            .unwrap()
            .into_iter()
            .map(|(name, value)| format!("{name}={value}"))
            .collect()
    }

    #[test]
    fn wildcards_cover_parts_of_names() {
        for (pattern, covered, other) in [
            ("/**", &["/a", "/a/b", "/a/b/c"][..], &[][..]),
            ("/*", &["/a"], &["/a/b"]),
            ("/*/*", &["/a/b"], &["/a", "/a/b/c"]),
            ("/**/b", &["/b", "/a/b", "/a/a/b"], &["/a", "/b/a"]),
            ("/a/*/c", &["/a/b/c"], &["/a/c", "/a/b/b/c"]),
            ("/a/**", &["/a", "/a/b", "/a/b/c"], &["/b/a"]),
            ("/**/**", &["/a", "/a/b"], &[]),
            ("b", &["/b"], &["/a/b"]),
            ("a/b", &["/a/b"], &["/b"]),
        ] {
            for node in covered {
                assert!(matches(pattern, node), "{pattern} {node}");
            }
            for node in other {
                assert!(!matches(pattern, node), "{pattern} {node}");
            }
        }
        let (stars, parts) = ("/**/a".repeat(25), "/a".repeat(60));
        assert!(matches(&stars, &parts) && !matches(&stars, &(parts + "/b")));
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
        assert_eq!(
            of(text, "/a/n"),
            ["rate=1.0", "gains.p=1", "gains.d=2", "rate=2.0"]
        );
    }

    #[test]
    fn what_comes_later_wins_not_what_is_more_special() {
        let (own, all) = (
            "/n: {ros__parameters: {a: 1}}",
            "/**: {ros__parameters: {a: 2}}",
        );
        assert_eq!(of(&format!("{own}\n{all}"), "/n"), ["a=1", "a=2"]);
        assert_eq!(of(&format!("{all}\n{own}"), "/n"), ["a=2", "a=1"]);
        assert_eq!(of(&format!("{all}\n---\n{own}"), "/n"), ["a=2", "a=1"]);
        assert_eq!(
            of("n: {ros__parameters: {a: 1, a: 2}}", "/n"),
            ["a=1", "a=2"]
        );
    }

    #[test]
    fn namespaces_nest_or_are_spelt_out() {
        for text in [
            "/a/n: {ros__parameters: {x: 1}}",
            "a/n: {ros__parameters: {x: 1}}",
            "a: {n: {ros__parameters: {x: 1}}}",
            "/a: {n: {ros__parameters: {x: 1}}}",
            "/**: {n: {ros__parameters: {x: 1}}}",
            "/a: {'*': {ros__parameters: {x: 1}}}",
        ] {
            assert_eq!(of(text, "/a/n"), ["x=1"], "{text}");
            assert!(of(text, "/b/m").is_empty(), "{text}");
        }
    }

    #[test]
    fn values_keep_the_types_of_rcl() {
        let text = "n: {ros__parameters: {a: 'yes', b: yes, c: '1', d: 017, e: null, <<: {f: 1}}}";
        let expected = [
            "a=\"yes\"",
            "b=true",
            "c=\"1\"",
            "d=15",
            "e=not set",
            "<<.f=1",
        ];
        assert_eq!(of(text, "/n"), expected);
    }

    #[test]
    fn malformed_files_say_what_is_wrong_and_where() {
        for (text, expected) in [
            ("[1]", "found a list"),
            (
                "a:\n  b: 1",
                "line 2: \"b\": expected a map with \"ros__parameters\", found an integer",
            ),
            (
                "a:",
                "\"a\": expected a map with \"ros__parameters\", found nothing",
            ),
            (
                "a:\n  ros__parameters:",
                "\"ros__parameters\": expected a map of parameters, found nothing",
            ),
            (
                "a: {ros__parameters: 5}",
                "expected a map of parameters, found an integer",
            ),
            (
                "a: {ros__parameters: {b: 1}, extra: 2}",
                "\"extra\": expected a map",
            ),
            ("ros__parameters: {a: 1}", "outside of any node"),
            ("a: [", "line 2"),
            (
                "n: {ros__parameters: {a: {b: }}}",
                "parameter \"a.b\": the value is missing (of node \"/n\")",
            ),
            (
                "m:\n ros__parameters:\n  a: [1, x]",
                "line 3: parameter \"a\": all of a list",
            ),
            (
                "n: {ros__parameters: {a: [[1]]}}",
                "parameter \"a\": a list must hold scalars only",
            ),
            ("/n*: {ros__parameters: {a: 1}}", "\"/n*\" is not a node"),
            ("n//x: {ros__parameters: {a: 1}}", "\"n//x\" is not a node"),
            ("n/: {ros__parameters: {a: 1}}", "\"n/\" is not a node"),
            ("/: {ros__parameters: {a: 1}}", "\"/\" is not a node"),
            ("'': {ros__parameters: {a: 1}}", "\"\" is not a node"),
            (
                "/a: {/n: {ros__parameters: {a: 1}}}",
                "\"/n\" is not a node",
            ),
        ] {
            let error = read(text, "/n").unwrap_err();
            assert!(error.contains(expected), "{text:?}: {error}");
        }
        assert!(read("", "/n").unwrap().is_empty());
        assert!(read("# nothing\n", "/n").unwrap().is_empty());
    }
}
