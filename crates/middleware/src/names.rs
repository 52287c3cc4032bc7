//! Names of nodes, namespaces and topics, by the rules of ROS 2
//! (<https://design.ros2.org/articles/topic_and_service_names.html>).

/// A name that ROS 2 does not allow, or that cannot be expanded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// The name is empty.
    #[error("a {kind} must not be empty")]
    Empty {
        /// What the name stands for.
        kind: &'static str,
    },
    /// A character outside `[A-Za-z0-9_/]`, or `/` where it is not allowed.
    #[error("{kind} {name:?} must not contain {character:?}")]
    Character {
        /// What the name stands for.
        kind: &'static str,
        /// The name as given.
        name: String,
        /// The first character that is not allowed.
        character: char,
    },
    /// A part between slashes is empty or starts with a digit.
    #[error("{kind} {name:?}: the part {token:?} must start with a letter or an underscore")]
    Token {
        /// What the name stands for.
        kind: &'static str,
        /// The name as given.
        name: String,
        /// The part between slashes at fault.
        token: String,
    },
    /// The name does not start with a slash.
    #[error("{kind} {name:?} must start with '/'")]
    NotAbsolute {
        /// What the name stands for.
        kind: &'static str,
        /// The name as given.
        name: String,
    },
    /// `~` elsewhere than at the start, or not followed by a slash.
    #[error("topic {name:?}: '~' may only stand at the start, followed by '/'")]
    Tilde {
        /// The name as given.
        name: String,
    },
    /// The name is too long for DDS.
    #[error("{kind} {name:?} has {length} characters; the limit is {limit}")]
    TooLong {
        /// What the name stands for.
        kind: &'static str,
        /// The name as given.
        name: String,
        /// Its length.
        length: usize,
        /// The longest that is allowed.
        limit: usize,
    },
}

const NODE: &str = "node name";
const NAMESPACE: &str = "namespace";
const TOPIC: &str = "topic";

/// `rmw`'s limits: 255 for DDS, less the prefix (`rt/`, `rq/`) and the suffix (`Reply`) for topics.
const NODE_LIMIT: usize = 255;
const TOPIC_LIMIT: usize = 247;

/// Checks a node's base name, such as `lgvi_propagator`.
pub(crate) fn check_node_name(name: &str) -> Result<(), NameError> {
    check_length(NODE, name, NODE_LIMIT)?;
    check_token(NODE, name, name)
}

/// Checks a namespace, such as `/` or `/chaser`; one without a leading slash gets it.
pub(crate) fn normalise_namespace(namespace: &str) -> Result<String, NameError> {
    let absolute = format!("/{}", namespace.strip_prefix('/').unwrap_or(namespace));
    if absolute != "/" {
        check_absolute(NAMESPACE, &absolute, NODE_LIMIT)?;
    }
    Ok(absolute)
}

/// `/name` or `/namespace/name`.
pub(crate) fn join(namespace: &str, name: &str) -> String {
    format!("{}/{name}", namespace.trim_end_matches('/'))
}

/// Expands `~`, `{node}`, `{ns}`, `{namespace}` and relative names to an absolute, valid topic name.
pub(crate) fn expand(name: &str, namespace: &str, node: &str) -> Result<String, NameError> {
    if name.is_empty() {
        return Err(NameError::Empty { kind: TOPIC });
    }
    let substituted = name
        .replace("{node}", node)
        .replace("{namespace}", namespace)
        .replace("{ns}", namespace);
    let absolute = match substituted.strip_prefix('~') {
        Some("") => join(namespace, node),
        Some(rest) if rest.starts_with('/') => join(namespace, node) + rest,
        Some(_) => return Err(NameError::Tilde { name: name.into() }),
        None if substituted.starts_with('/') => substituted,
        None => join(namespace, &substituted),
    };
    if absolute.contains('~') {
        return Err(NameError::Tilde { name: name.into() });
    }
    check_absolute(TOPIC, &absolute, TOPIC_LIMIT)?;
    Ok(absolute)
}

fn check_absolute(kind: &'static str, name: &str, limit: usize) -> Result<(), NameError> {
    check_length(kind, name, limit)?;
    let Some(relative) = name.strip_prefix('/') else {
        return Err(NameError::NotAbsolute {
            kind,
            name: name.into(),
        });
    };
    relative
        .split('/')
        .try_for_each(|token| check_token(kind, name, token))
}

fn check_length(kind: &'static str, name: &str, limit: usize) -> Result<(), NameError> {
    match name.len() {
        0 => Err(NameError::Empty { kind }),
        length if length > limit => Err(NameError::TooLong {
            kind,
            name: name.into(),
            length,
            limit,
        }),
        _ => Ok(()),
    }
}

fn check_token(kind: &'static str, name: &str, token: &str) -> Result<(), NameError> {
    if let Some(character) = token
        .chars()
        .find(|c| !(c.is_ascii_alphanumeric() || *c == '_'))
    {
        return Err(NameError::Character {
            kind,
            name: name.into(),
            character,
        });
    }
    if token.starts_with(|c: char| c.is_ascii_digit()) || token.is_empty() {
        return Err(NameError::Token {
            kind,
            name: name.into(),
            token: token.into(),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expands_private_relative_and_absolute_names() {
        let expand = |name| expand(name, "/chaser", "lgvi_propagator").unwrap();
        assert_eq!(expand("~/state"), "/chaser/lgvi_propagator/state");
        assert_eq!(expand("~"), "/chaser/lgvi_propagator");
        assert_eq!(expand("state"), "/chaser/state");
        assert_eq!(expand("/tf"), "/tf");
        assert_eq!(expand("{ns}/{node}/x"), "/chaser/lgvi_propagator/x");
        assert_eq!(super::expand("state", "/", "n").unwrap(), "/state");
    }

    #[test]
    fn refuses_what_ros_refuses() {
        for bad in [
            "", "~state", "a/~/b", "a//b", "a/", "1a", "a/2b", "a b", "a-b", "{x}",
        ] {
            assert!(expand(bad, "/", "node").is_err(), "{bad:?} was accepted");
        }
        assert!(matches!(
            expand(&"a".repeat(300), "/", "node"),
            Err(NameError::TooLong { length: 301, .. })
        ));
        assert!(check_node_name("a/b").is_err());
        assert!(check_node_name("9a").is_err());
        assert_eq!(
            check_node_name("a b"),
            Err(NameError::Character {
                kind: NODE,
                name: "a b".into(),
                character: ' '
            })
        );
    }

    #[test]
    fn namespaces_are_absolute() {
        assert_eq!(normalise_namespace("chaser").unwrap(), "/chaser");
        assert_eq!(normalise_namespace("/a/b").unwrap(), "/a/b");
        assert_eq!(normalise_namespace("/").unwrap(), "/");
        assert_eq!(normalise_namespace("").unwrap(), "/");
        assert!(normalise_namespace("/a/").is_err());
    }
}
