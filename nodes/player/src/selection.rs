//! Which topics of a bag are played, decided as rosbag2 does.

use lgvi_middleware::node::NodeError;
use lgvi_middleware::{ParameterSpec, ParameterValue, Parameters};
use regex::Regex;

/// Topics to be played, by the names that they have in the bag.
#[derive(Debug, Default)]
pub(crate) struct Selection {
    /// Topics by name.
    topics: Vec<String>,
    /// Further topics, whose names contain this. Where neither chooses any, all are played.
    regex: Option<Regex>,
    /// Topics that are left out in any case.
    exclude_topics: Vec<String>,
    /// The same by what their names contain.
    exclude_regex: Option<Regex>,
}

impl Selection {
    pub(crate) fn specifications() -> [ParameterSpec; 4] {
        let names = |name, description| ParameterSpec::new(name, Vec::<String>::new(), description);
        let pattern = |name, description| {
            ParameterSpec::new(name, String::new(), description)
                .constraints("a regular expression")
                .check(is_regular)
        };
        [
            names(
                "topics",
                "topics to play, by their names in the bag; empty: all, or those that match regex",
            ),
            pattern("regex", "also play topics whose names match"),
            names("exclude_topics", "topics not to play"),
            pattern("exclude_regex", "do not play topics whose names match"),
        ]
    }

    pub(crate) fn read(parameters: &Parameters) -> Result<Self, NodeError> {
        let names = |name| parameters.get(name).map_err(NodeError::input);
        let pattern = |name| {
            let text: String = parameters.get(name)?;
            let given = (!text.is_empty()).then(|| Regex::new(&text));
            given.transpose().map_err(NodeError::input)
        };
        Ok(Self {
            topics: names("topics")?,
            regex: pattern("regex")?,
            exclude_topics: names("exclude_topics")?,
            exclude_regex: pattern("exclude_regex")?,
        })
    }

    /// Whether a topic is to be played.
    pub(crate) fn takes(&self, topic: &str) -> bool {
        let named = |names: &[String]| names.iter().any(|name| name == topic);
        let matches =
            |regex: &Option<Regex>| regex.as_ref().is_some_and(|regex| regex.is_match(topic));
        let all = self.topics.is_empty() && self.regex.is_none();
        (all || named(&self.topics) || matches(&self.regex))
            && !named(&self.exclude_topics)
            && !matches(&self.exclude_regex)
    }

    /// Topics that are asked for by name.
    pub(crate) fn asked_for(&self) -> &[String] {
        &self.topics
    }
}

fn is_regular(value: &ParameterValue) -> Result<(), String> {
    match value {
        ParameterValue::String(text) => Regex::new(text)
            .map(drop)
            .map_err(|error| format!("expected a regular expression: {error}")),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    fn regex(text: &str) -> Option<Regex> {
        Some(Regex::new(text).unwrap())
    }

    #[test]
    fn all_are_played_unless_some_are_chosen() {
        assert!(Selection::default().takes("/tf"));
        let chosen = Selection {
            topics: names(&["/tf"]),
            regex: regex("odometry/.*"),
            ..Selection::default()
        };
        for (topic, taken) in [
            ("/tf", true),
            ("/x/odometry/body", true),
            ("/tf_static", false),
        ] {
            assert_eq!(chosen.takes(topic), taken, "{topic}");
        }
        let by_regex = Selection {
            regex: regex("^/tf$"),
            ..Selection::default()
        };
        assert!(by_regex.takes("/tf") && !by_regex.takes("/tf_static"));
    }

    #[test]
    fn what_is_excluded_is_left_out_in_any_case() {
        let chosen = Selection {
            topics: names(&["/tf", "/clock", "/a"]),
            exclude_topics: names(&["/clock"]),
            exclude_regex: regex("^/t"),
            ..Selection::default()
        };
        assert!(chosen.takes("/a"));
        assert!(!chosen.takes("/clock") && !chosen.takes("/tf"));
    }

    #[test]
    fn what_is_no_regular_expression_is_refused() {
        assert!(is_regular(&"^/tf(_static)?$".into()).is_ok());
        let refusal = is_regular(&"a(".into()).unwrap_err();
        assert!(refusal.contains("unclosed group"), "{refusal}");
    }
}
