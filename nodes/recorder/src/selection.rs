//! Which topics are recorded from DDS, decided as rosbag2 does.

use std::collections::BTreeSet;

use lgvi_common::{Choice, Selection};

/// Topics that are to be recorded.
#[derive(Debug, Default)]
pub(crate) struct Wanted {
    /// What is chosen by name, or by what names contain.
    pub(crate) selection: Selection,
    /// The node's namespace, with a slash at its end; its topics are recorded, and those shared, where nothing is chosen.
    pub(crate) namespace: String,
    /// Topics that all nodes of a graph share.
    pub(crate) shared: BTreeSet<String>,
    /// Whether topics are recorded of whose names a part begins with `_`, though they are not chosen by name.
    pub(crate) hidden: bool,
}

impl Wanted {
    /// Whether a topic is to be recorded.
    pub(crate) fn takes(&self, topic: &str) -> bool {
        let own = || topic.starts_with(&self.namespace) || self.shared.contains(topic);
        let shown = self.hidden || !is_hidden(topic);
        match self.selection.choice(topic) {
            Choice::Name => true,
            Choice::Match => shown,
            Choice::Default => shown && own(),
            Choice::No => false,
        }
    }
}

/// Whether a topic is of those that tools do not show, as the topics of an action.
fn is_hidden(topic: &str) -> bool {
    topic.split('/').any(|part| part.starts_with('_'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_but_hidden_ones_are_recorded_unless_something_is_chosen() {
        let all = Wanted::default();
        for (topic, taken) in [
            ("/tf", true),
            ("/parameter_events", true),
            ("/planner/plan/_action/feedback", false),
            ("/_hidden/topic", false),
            ("/not_hidden_", true),
        ] {
            assert_eq!(all.takes(topic), taken, "{topic}");
        }
        let hidden = Wanted {
            hidden: true,
            ..all
        };
        assert!(hidden.takes("/planner/plan/_action/feedback"));
        let mut chosen = Wanted::default();
        chosen.selection.names = Some(["/a/_action/status".to_owned()].into());
        assert!(chosen.takes("/a/_action/status") && !chosen.takes("/tf"));
    }

    #[test]
    fn a_namespace_has_its_own_topics_and_those_that_all_share() {
        let own = Wanted {
            namespace: "/chaser/".into(),
            shared: ["/tf".to_owned()].into(),
            ..Wanted::default()
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
    }
}
