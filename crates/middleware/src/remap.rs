//! Remapping rules: `[node:][rostopic://|rosservice://]from:=to`, `[node:]__node:=name`, `[node:]__ns:=/namespace`.

use crate::names::{self, Kind, NameError};

/// What a rule replaces.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Target {
    NodeName,
    Namespace,
    /// The name as given, of topics only, of services only, or of whatever bears it.
    Name(Option<Kind>, String),
}

/// A rule as given on the command line; its names are expanded when that of the node is known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Rule {
    node: Option<String>,
    target: Target,
    to: String,
}

/// The rules of one process, in order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Rules(Vec<Rule>);

impl Rule {
    /// Reads a rule by the grammar of `rcl`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let (left, to) = text
            .split_once(":=")
            .ok_or("it is not of the form [node:]from:=to")?;
        let (node, from) = split_node(left)?;
        let target = match from {
            "__node" | "__name" => Target::NodeName,
            "__ns" => Target::Namespace,
            _ => named(from)?,
        };
        match target {
            Target::NodeName => names::check_node_name(to).map_err(|error| error.to_string())?,
            Target::Namespace => {
                names::check_namespace(names::NAMESPACE, to).map_err(|error| error.to_string())?
            }
            Target::Name(..) => check_name(to)?,
        }
        Ok(Self {
            node: node.map(Into::into),
            target,
            to: to.into(),
        })
    }

    fn applies_to(&self, node: &str) -> bool {
        self.node.as_deref().is_none_or(|name| name == node)
    }
}

impl Rules {
    pub(crate) fn push(&mut self, rule: Rule) {
        self.0.push(rule);
    }

    /// The node's base name: that of the first `__node` rule for the default name, else the default.
    pub(crate) fn node_name(&self, default: &str) -> Result<String, NameError> {
        let name = self.first(default, &Target::NodeName).unwrap_or(default);
        names::check_node_name(name)?;
        Ok(name.into())
    }

    /// The namespace of the node that has got its name: that of the first `__ns` rule, else the root.
    pub(crate) fn namespace(&self, node: &str) -> String {
        self.first(node, &Target::Namespace).unwrap_or("/").into()
    }

    /// Expands a name and replaces it by the first rule that matches it. What comes out is not replaced again.
    pub(crate) fn resolve(
        &self,
        kind: Kind,
        name: &str,
        namespace: &str,
        node: &str,
    ) -> Result<String, NameError> {
        let expand = |name: &str| names::expand(kind, name, namespace, node);
        let name = expand(name)?;
        for rule in self.0.iter().filter(|rule| rule.applies_to(node)) {
            if let Target::Name(of, from) = &rule.target
                && of.is_none_or(|of| of == kind)
                && expand(from)? == name
            {
                return expand(&rule.to);
            }
        }
        Ok(name)
    }

    fn first(&self, node: &str, target: &Target) -> Option<&str> {
        self.0
            .iter()
            .find(|rule| rule.applies_to(node) && rule.target == *target)
            .map(|rule| rule.to.as_str())
    }
}

/// Splits `[node:]rest`; the colon of `rostopic://` parts nothing.
pub(crate) fn split_node(left: &str) -> Result<(Option<&str>, &str), String> {
    match left.split_once(':') {
        Some((_, rest)) if rest.starts_with("//") => Ok((None, left)),
        Some((node, rest)) if names::is_rule_token(node) => Ok((Some(node), rest)),
        Some((node, _)) => Err(format!("{node:?} is not the name of a node")),
        None => Ok((None, left)),
    }
}

fn named(from: &str) -> Result<Target, String> {
    let (kind, name) = if let Some(name) = from.strip_prefix("rostopic://") {
        (Some(Kind::Topic), name)
    } else if let Some(name) = from.strip_prefix("rosservice://") {
        (Some(Kind::Service), name)
    } else {
        (None, from)
    };
    check_name(name)?;
    Ok(Target::Name(kind, name.into()))
}

/// `[~]/part/part` or `part/part`, and nothing to be substituted.
fn check_name(name: &str) -> Result<(), String> {
    let parts = name
        .strip_prefix("~/")
        .or_else(|| name.strip_prefix('/'))
        .unwrap_or(name);
    if parts.split('/').all(names::is_rule_token) {
        Ok(())
    } else if name.contains('*') {
        Err(format!("{name:?}: ROS 2 has no wildcards in remapping"))
    } else {
        Err(format!(
            "{name:?} is not a name: parts of letters, digits and single underscores, separated by slashes"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rules(texts: &[&str]) -> Rules {
        let rules = texts.iter().map(|text| Rule::parse(text).unwrap());
        Rules(rules.collect())
    }

    fn topic(rules: &Rules, name: &str, namespace: &str) -> String {
        rules.resolve(Kind::Topic, name, namespace, "n").unwrap()
    }

    #[test]
    fn the_first_matching_rule_wins_and_no_other_follows() {
        let rules = rules(&[
            "~/state:=/truth",
            "/n/state:=/other",
            "tf:=frames",
            "/truth:=/no",
        ]);
        assert_eq!(topic(&rules, "~/state", "/"), "/truth");
        assert_eq!(topic(&rules, "/n/state", "/"), "/truth");
        assert_eq!(topic(&rules, "tf", "/a"), "/a/frames");
        assert_eq!(topic(&rules, "/tf", "/a"), "/tf");
        assert_eq!(topic(&rules, "~/state", "/a"), "/truth");
    }

    #[test]
    fn schemes_select_topics_or_services() {
        let resolve = |rule: &str, kind| rules(&[rule]).resolve(kind, "chatter", "/", "n").unwrap();
        for (rule, topic, service, action) in [
            ("chatter:=foo", "/foo", "/foo", "/foo"),
            ("rostopic://chatter:=foo", "/foo", "/chatter", "/chatter"),
            ("rostopic:///chatter:=foo", "/foo", "/chatter", "/chatter"),
            ("rosservice://chatter:=foo", "/chatter", "/foo", "/chatter"),
            (
                "n:rosservice:///chatter:=~/foo",
                "/chatter",
                "/n/foo",
                "/chatter",
            ),
            (
                "m:rosservice:///chatter:=~/foo",
                "/chatter",
                "/chatter",
                "/chatter",
            ),
            // Neither is a scheme, but a name.
            (
                "rosservice:chatter:=foo",
                "/chatter",
                "/chatter",
                "/chatter",
            ),
            ("rostopic:=foo", "/chatter", "/chatter", "/chatter"),
        ] {
            assert_eq!(resolve(rule, Kind::Topic), topic, "{rule}");
            assert_eq!(resolve(rule, Kind::Service), service, "{rule}");
            assert_eq!(resolve(rule, Kind::Action), action, "{rule}");
        }
    }

    #[test]
    fn node_prefixes_select_the_node_by_the_name_it_has_got() {
        let rules = rules(&[
            "me:__node:=x",
            "me:__ns:=/me",
            "x:__ns:=/x",
            "x:s:=/b",
            "me:s:=/a",
        ]);
        assert_eq!(rules.node_name("other").unwrap(), "other");
        assert_eq!(rules.node_name("me").unwrap(), "x");
        assert_eq!(rules.namespace("x"), "/x");
        assert_eq!(rules.namespace("other"), "/");
        assert_eq!(rules.resolve(Kind::Topic, "s", "/x", "x").unwrap(), "/b");
    }

    #[test]
    fn names_of_nodes_are_replaced_by_the_first_rule() {
        let rules = rules(&["__name:=a", "__node:=b", "__ns:=/", "__ns:=/z"]);
        assert_eq!(rules.node_name("n").unwrap(), "a");
        assert_eq!(rules.namespace("a"), "/");
    }

    /// Each of these `rcl` of ROS 2 Jazzy refuses too.
    #[test]
    fn malformed_rules_are_refused() {
        for bad in [
            "",
            "a",
            "a=b",
            "a:b",
            ":=b",
            "a:=",
            ":a:=b",
            "a:b:c:=d",
            "/n:__ns:=/x",
            "a:=b:=c",
            "1a:=b",
            "a:=1b",
            "a b:=c",
            "a-b:=c",
            "a//b:=c",
            "/:=x",
            "a:=/",
            "a:=//x",
            "a/:=x",
            "a:=x/",
            "~:=x",
            "a:=~",
            "a:=~/",
            "a:=b/~/c",
            "{node}/x:=q",
            "a:={node}",
            "a:=\\1",
            "a/*:=b",
            "/**:=b",
            "a__b:=c",
            "a:=b__c",
            "a:=__b",
            "__foo:=bar",
            "ROSTOPIC://a:=b",
            "rosaction://a:=b",
            "rostopic://n:a:=b",
            "rostopic://__node:=a",
            "rostopic:///a:=rostopic://b",
            "__node:=",
            "__node:=a/b",
            "__node:=1a",
            "__node:={node}",
            "__ns:=",
            "__ns:=a",
            "__ns:=/a/",
            "__ns:=/1",
            "__ns:=~/a",
            "__ns:=//",
        ] {
            assert!(Rule::parse(bad).is_err(), "{bad:?} was accepted");
        }
    }
}
