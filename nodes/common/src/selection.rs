//! Which topics are taken, by the parameters and rules of rosbag2.

use std::collections::BTreeSet;

use lgvi_middleware::node::NodeError;
use lgvi_middleware::{ParameterSpec, ParameterValue, Parameters};
use regex::Regex;

const REGEX: &str = "regex";
const EXCLUDE_REGEX: &str = "exclude_regex";

/// Topics that are chosen by name or by what their names contain.
#[derive(Debug, Default)]
pub struct Selection {
    /// Topics by name, if any are.
    pub names: Option<BTreeSet<String>>,
    /// Topics that are left out in any case.
    pub exclude: BTreeSet<String>,
    regex: Option<Regex>,
    exclude_regex: Option<Regex>,
}

/// Why a topic is taken, or that it is not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Its name is given.
    Name,
    /// Its name matches.
    Match,
    /// Nothing is given to choose by.
    Default,
    /// It is not taken.
    No,
}

impl Selection {
    /// The parameters `regex` and `exclude_regex`, with their descriptions.
    pub fn patterns(take: &str, leave_out: &str) -> [ParameterSpec; 2] {
        [(REGEX, take), (EXCLUDE_REGEX, leave_out)].map(|(name, description)| {
            ParameterSpec::new(name, String::new(), description)
                .constraints("a regular expression")
                .check(is_regular)
        })
    }

    /// Reads those parameters.
    ///
    /// # Errors
    /// They are not declared.
    pub fn read(
        parameters: &Parameters,
        names: Option<BTreeSet<String>>,
        exclude: BTreeSet<String>,
    ) -> Result<Self, NodeError> {
        let pattern = |name| {
            let text: String = parameters.get(name)?;
            let given = (!text.is_empty()).then(|| Regex::new(&text));
            given.transpose().map_err(NodeError::input)
        };
        Ok(Self {
            names,
            exclude,
            regex: pattern(REGEX)?,
            exclude_regex: pattern(EXCLUDE_REGEX)?,
        })
    }

    /// Whether and why a topic is taken.
    pub fn choice(&self, topic: &str) -> Choice {
        let matches =
            |regex: &Option<Regex>| regex.as_ref().is_some_and(|regex| regex.is_match(topic));
        if self.exclude.contains(topic) || matches(&self.exclude_regex) {
            return Choice::No;
        }
        match &self.names {
            Some(names) if names.contains(topic) => Choice::Name,
            _ if matches(&self.regex) => Choice::Match,
            None if self.regex.is_none() => Choice::Default,
            _ => Choice::No,
        }
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

    fn names<const N: usize>(names: [&str; N]) -> BTreeSet<String> {
        names.map(String::from).into()
    }

    fn regex(text: &str) -> Option<Regex> {
        Some(Regex::new(text).unwrap())
    }

    #[test]
    fn topics_are_chosen_by_name_and_by_match_and_all_if_nothing_is_given() {
        assert_eq!(Selection::default().choice("/tf"), Choice::Default);
        let chosen = Selection {
            names: Some(names(["/tf"])),
            regex: regex("odometry/.*"),
            ..Selection::default()
        };
        for (topic, choice) in [
            ("/tf", Choice::Name),
            ("/x/odometry/body", Choice::Match),
            ("/tf_static", Choice::No),
        ] {
            assert_eq!(chosen.choice(topic), choice, "{topic}");
        }
        let by_regex = Selection {
            regex: regex("^/tf$"),
            ..Selection::default()
        };
        let choices = ["/tf", "/tf_static"].map(|topic| by_regex.choice(topic));
        assert_eq!(choices, [Choice::Match, Choice::No]);
        let nothing = Selection {
            names: Some(names([])),
            ..Selection::default()
        };
        assert_eq!(nothing.choice("/tf"), Choice::No);
    }

    #[test]
    fn what_is_excluded_is_left_out_in_any_case() {
        let chosen = Selection {
            names: Some(names(["/tf", "/clock", "/a"])),
            exclude: names(["/clock"]),
            exclude_regex: regex("^/t"),
            ..Selection::default()
        };
        let choices = ["/a", "/clock", "/tf"].map(|topic| chosen.choice(topic));
        assert_eq!(choices, [Choice::Name, Choice::No, Choice::No]);
    }

    #[test]
    fn what_is_no_regular_expression_is_refused() {
        assert!(is_regular(&"^/tf(_static)?$".into()).is_ok());
        let refusal = is_regular(&"a(".into()).unwrap_err();
        assert!(refusal.contains("unclosed group"), "{refusal}");
    }
}
