//! Remapping rules: `[node:]from:=to`.

use crate::names::{self, NameError};

/// A rule as given on the command line; expanded when the node's name is known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Rule {
    node: Option<String>,
    from: String,
    to: String,
}

/// The rules of one process, in order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Rules(Vec<Rule>);

impl Rule {
    /// Splits `[node:]from:=to`; `None` if it has no `:=` or an empty side.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let (node, from, to) = split_assignment(text)?;
        (!to.is_empty()).then(|| Self {
            node: node.map(Into::into),
            from: from.into(),
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

    /// The node's base name: the first `__node` rule, else the default.
    pub(crate) fn node_name(&self, default: &str) -> Result<String, NameError> {
        let name = self
            .special(default, &["__node", "__name"])
            .unwrap_or(default);
        names::check_node_name(name)?;
        Ok(name.into())
    }

    /// The node's namespace: the first `__ns` rule, else the root.
    pub(crate) fn namespace(&self, default_name: &str) -> Result<String, NameError> {
        names::normalise_namespace(self.special(default_name, &["__ns"]).unwrap_or("/"))
    }

    /// Expands a topic name and replaces it by the first rule that matches it.
    pub(crate) fn topic(
        &self,
        topic: &str,
        namespace: &str,
        node: &str,
    ) -> Result<String, NameError> {
        let expand = |name: &str| names::expand(name, namespace, node);
        let topic = expand(topic)?;
        for rule in self.0.iter().filter(|rule| rule.applies_to(node)) {
            if !rule.from.starts_with("__") && expand(&rule.from)? == topic {
                return expand(&rule.to);
            }
        }
        Ok(topic)
    }

    fn special(&self, node: &str, keys: &[&str]) -> Option<&str> {
        self.0
            .iter()
            .find(|rule| rule.applies_to(node) && keys.contains(&rule.from.as_str()))
            .map(|rule| rule.to.as_str())
    }
}

/// Splits `[node:]name:=value`; `None` without `:=` or with an empty name or node.
pub(crate) fn split_assignment(text: &str) -> Option<(Option<&str>, &str, &str)> {
    let (left, value) = text.split_once(":=")?;
    let (node, name) = match left.split_once(':') {
        Some((node, name)) => (Some(node), name),
        None => (None, left),
    };
    (!name.is_empty() && node != Some("")).then_some((node, name, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rules(texts: &[&str]) -> Rules {
        Rules(
            texts
                .iter()
                .map(|text| Rule::parse(text).unwrap())
                .collect(),
        )
    }

    #[test]
    fn the_first_matching_rule_wins() {
        let rules = rules(&["~/state:=/truth", "/n/state:=/other", "tf:=frames"]);
        assert_eq!(rules.topic("~/state", "/", "n").unwrap(), "/truth");
        assert_eq!(rules.topic("/n/state", "/", "n").unwrap(), "/truth");
        assert_eq!(rules.topic("tf", "/a", "n").unwrap(), "/a/frames");
        assert_eq!(rules.topic("/tf", "/a", "n").unwrap(), "/tf");
    }

    #[test]
    fn node_prefixes_select_the_node() {
        let rules = rules(&[
            "other:state:=/a",
            "me:state:=/b",
            "other:__node:=x",
            "__ns:=/y",
        ]);
        assert_eq!(rules.topic("state", "/", "me").unwrap(), "/b");
        assert_eq!(rules.node_name("me").unwrap(), "me");
        assert_eq!(rules.node_name("other").unwrap(), "x");
        assert_eq!(rules.namespace("me").unwrap(), "/y");
    }

    #[test]
    fn malformed_rules_are_refused() {
        for bad in ["", "a", "a=b", ":=b", "a:=", ":a:=b"] {
            assert_eq!(Rule::parse(bad), None, "{bad:?} was accepted");
        }
    }
}
