//! Names of nodes, namespaces and topics, by the rules of ROS 2
//! (<https://design.ros2.org/articles/topic_and_service_names.html>).

/// A name that ROS 2 does not allow, or that cannot be expanded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{kind} {name:?} {reason}")]
pub struct NameError {
    /// What the name stands for.
    kind: &'static str,
    /// The name as given, of what is expanded the absolute one.
    name: String,
    /// What it must or must not be.
    reason: String,
}

impl NameError {
    fn new(kind: &'static str, name: &str, reason: impl Into<String>) -> Self {
        let (name, reason) = (name.into(), reason.into());
        Self { kind, name, reason }
    }
}

/// What a name stands for that is expanded and remapped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Topic,
    Service,
    Action,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Topic => "topic",
            Self::Service => "service",
            Self::Action => "action",
        }
    }
}

const NODE: &str = "node name";
pub(crate) const NAMESPACE: &str = "namespace";
pub(crate) const ENCLAVE: &str = "enclave";

const EMPTY: &str = "must not be empty";

/// `rmw`'s limits: 255 for DDS, less the prefix (`rt/`, `rq/`) and the suffix (`Reply`) for topics.
const NODE_LIMIT: usize = 255;
const TOPIC_LIMIT: usize = 247;

/// Checks a node's base name, such as `lgvi_propagator`.
pub(crate) fn check_node_name(name: &str) -> Result<(), NameError> {
    check_length(NODE, name, NODE_LIMIT)?;
    check_token(NODE, name, name)
}

/// Checks a namespace, or an enclave, which has its form: `/`, or `/chaser` without a slash at its end.
pub(crate) fn check_namespace(kind: &'static str, name: &str) -> Result<(), NameError> {
    match name {
        "/" => Ok(()),
        _ => check_absolute(kind, name, NODE_LIMIT),
    }
}

/// Whether a text can stand between two slashes.
pub(crate) fn is_token(text: &str) -> bool {
    text.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && text
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}

/// Whether a text is a token of the rules on the command line, where two underscores introduce `__node` and its like.
pub(crate) fn is_rule_token(text: &str) -> bool {
    is_token(text) && !text.contains("__")
}

/// `/name` or `/namespace/name`.
pub(crate) fn join(namespace: &str, name: &str) -> String {
    format!("{}/{name}", namespace.trim_end_matches('/'))
}

/// Expands `~`, `{node}`, `{ns}`, `{namespace}` and relative names to an absolute, valid name.
pub(crate) fn expand(
    kind: Kind,
    name: &str,
    namespace: &str,
    node: &str,
) -> Result<String, NameError> {
    let kind = kind.name();
    let misplaced_tilde = || {
        NameError::new(
            kind,
            name,
            "must have '~' only at the start, followed by '/'",
        )
    };
    if name.is_empty() {
        return Err(NameError::new(kind, name, EMPTY));
    }
    let substituted = name
        .replace("{node}", node)
        .replace("{namespace}", namespace)
        .replace("{ns}", namespace);
    let absolute = match substituted.strip_prefix('~') {
        Some("") => join(namespace, node),
        Some(rest) if rest.starts_with('/') => join(namespace, node) + rest,
        Some(_) => return Err(misplaced_tilde()),
        None if substituted.starts_with('/') => substituted,
        None => join(namespace, &substituted),
    };
    if absolute.contains('~') {
        return Err(misplaced_tilde());
    }
    check_absolute(kind, &absolute, TOPIC_LIMIT)?;
    Ok(absolute)
}

fn check_absolute(kind: &'static str, name: &str, limit: usize) -> Result<(), NameError> {
    check_length(kind, name, limit)?;
    name.strip_prefix('/')
        .ok_or_else(|| NameError::new(kind, name, "must start with '/'"))?
        .split('/')
        .try_for_each(|token| check_token(kind, name, token))
}

fn check_length(kind: &'static str, name: &str, limit: usize) -> Result<(), NameError> {
    match name.len() {
        0 => Err(NameError::new(kind, name, EMPTY)),
        length if length > limit => {
            let reason = format!("has {length} characters; the limit is {limit}");
            Err(NameError::new(kind, name, reason))
        }
        _ => Ok(()),
    }
}

fn check_token(kind: &'static str, name: &str, token: &str) -> Result<(), NameError> {
    let is_known = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let reason = if let Some(other) = token.chars().find(|c| !is_known(*c)) {
        format!("must not contain {other:?}")
    } else if !is_token(token) {
        format!("has the part {token:?}, which must start with a letter or an underscore")
    } else {
        return Ok(());
    };
    Err(NameError::new(kind, name, reason))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expands_private_relative_and_absolute_names() {
        let expand = |name| expand(Kind::Topic, name, "/chaser", "lgvi_propagator").unwrap();
        assert_eq!(expand("~/state"), "/chaser/lgvi_propagator/state");
        assert_eq!(expand("~"), "/chaser/lgvi_propagator");
        assert_eq!(expand("state"), "/chaser/state");
        assert_eq!(expand("/tf"), "/tf");
        assert_eq!(expand("{ns}/{node}/x"), "/chaser/lgvi_propagator/x");
        assert_eq!(
            super::expand(Kind::Topic, "state", "/", "n").unwrap(),
            "/state"
        );
    }

    #[test]
    fn refuses_what_ros_refuses() {
        for bad in [
            "", "~state", "a/~/b", "a//b", "a/", "1a", "a/2b", "a b", "a-b", "{x}",
        ] {
            assert!(
                expand(Kind::Topic, bad, "/", "node").is_err(),
                "{bad:?} was accepted"
            );
        }
        let error = expand(Kind::Service, &"a".repeat(300), "/", "node").unwrap_err();
        assert!(error.to_string().contains("has 301 characters"), "{error}");
        assert!(check_node_name("a/b").is_err());
        assert!(check_node_name("9a").is_err());
        let error = check_node_name("a b").unwrap_err().to_string();
        assert_eq!(error, "node name \"a b\" must not contain ' '");
    }

    #[test]
    fn namespaces_and_enclaves_are_absolute() {
        for (good, bad) in [
            ("/", ""),
            ("/a", "a"),
            ("/a/b", "/a/"),
            ("/_", "/1"),
            ("/a__b", "~/a"),
        ] {
            assert_eq!(check_namespace(NAMESPACE, good), Ok(()));
            assert!(check_namespace(NAMESPACE, bad).is_err(), "{bad:?}");
        }
        let error = check_namespace(ENCLAVE, "a b").unwrap_err().to_string();
        assert_eq!(error, "enclave \"a b\" must start with '/'");
    }
}
