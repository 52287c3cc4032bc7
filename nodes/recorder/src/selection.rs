//! Which topics are recorded from DDS, decided as rosbag2 does.

use std::collections::BTreeSet;

use regex::Regex;

/// Topics that are to be recorded.
#[derive(Debug, Default)]
pub(crate) struct Selection {
    /// Topics by name; none: without `regex`, those of the namespace and those shared.
    pub(crate) names: Option<BTreeSet<String>>,
    /// Further topics, whose names contain this.
    pub(crate) regex: Option<Regex>,
    /// The node's namespace, with a slash at its end.
    pub(crate) namespace: String,
    /// Topics that all nodes of a graph share.
    pub(crate) shared: BTreeSet<String>,
    /// Topics that are left out in any case.
    pub(crate) exclude: BTreeSet<String>,
    /// The same by what their names contain.
    pub(crate) exclude_regex: Option<Regex>,
    /// Whether topics are recorded of whose names a part begins with `_`, though they are not in `names`.
    pub(crate) hidden: bool,
}

impl Selection {
    /// Whether a topic is to be recorded.
    pub(crate) fn takes(&self, topic: &str) -> bool {
        let matches =
            |regex: &Option<Regex>| regex.as_ref().is_some_and(|regex| regex.is_match(topic));
        if self.exclude.contains(topic) || matches(&self.exclude_regex) {
            return false;
        }
        if self
            .names
            .as_ref()
            .is_some_and(|names| names.contains(topic))
        {
            return true;
        }
        let chosen = if self.names.is_none() && self.regex.is_none() {
            topic.starts_with(&self.namespace) || self.shared.contains(topic)
        } else {
            matches(&self.regex)
        };
        chosen && (self.hidden || !is_hidden(topic))
    }
}

/// Whether a topic is of those that tools do not show, as the topics of an action.
fn is_hidden(topic: &str) -> bool {
    topic.split('/').any(|part| part.starts_with('_'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> BTreeSet<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    fn regex(text: &str) -> Option<Regex> {
        Some(Regex::new(text).unwrap())
    }

    #[test]
    fn all_but_hidden_ones_are_recorded_unless_something_is_chosen() {
        let all = Selection::default();
        for (topic, taken) in [
            ("/tf", true),
            ("/parameter_events", true),
            ("/planner/plan/_action/feedback", false),
            ("/_hidden/topic", false),
            ("/not_hidden_", true),
        ] {
            assert_eq!(all.takes(topic), taken, "{topic}");
        }
        let hidden = Selection {
            hidden: true,
            ..all
        };
        assert!(hidden.takes("/planner/plan/_action/feedback"));
    }

    #[test]
    fn a_namespace_has_its_own_topics_and_those_that_all_share() {
        let own = Selection {
            namespace: "/chaser/".into(),
            shared: names(&["/tf"]),
            ..Selection::default()
        };
        for (topic, taken) in [
            ("/chaser/lgvi_propagator/scene", true),
            ("/tf", true),
            ("/chaser_2/lgvi_propagator/scene", false),
            ("/target/tf", false),
            ("/odom", false),
        ] {
            assert_eq!(own.takes(topic), taken, "{topic}");
        }
        let all = Selection {
            regex: regex(".*"),
            ..own
        };
        assert!(all.takes("/target/tf"));
    }

    #[test]
    fn names_and_what_matches_are_recorded_together() {
        let chosen = Selection {
            names: Some(names(&["/tf", "/a/_action/status"])),
            regex: regex("odometry/.*"),
            ..Selection::default()
        };
        for (topic, taken) in [
            ("/tf", true),
            ("/a/_action/status", true),
            ("/x/odometry/body", true),
            ("/x/odometry/_body", false),
            ("/tf_static", false),
        ] {
            assert_eq!(chosen.takes(topic), taken, "{topic}");
        }
        let nothing = Selection {
            names: Some(names(&[])),
            ..Selection::default()
        };
        assert!(!nothing.takes("/tf"));
    }

    #[test]
    fn what_is_excluded_is_left_out_in_any_case() {
        let chosen = Selection {
            names: Some(names(&["/tf", "/clock", "/a"])),
            exclude: names(&["/clock"]),
            exclude_regex: regex("^/t"),
            ..Selection::default()
        };
        assert!(chosen.takes("/a"));
        assert!(!chosen.takes("/clock") && !chosen.takes("/tf"));
    }
}
