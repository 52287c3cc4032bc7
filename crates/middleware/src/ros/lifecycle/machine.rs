//! The states of a managed node and the transitions between them
//! (<https://design.ros2.org/articles/node_lifecycle.html>), with the numbers of `lifecycle_msgs`.

use lgvi_msgs::lifecycle_msgs as messages;
use messages::State as Number;

/// Where a managed node is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum State {
    /// Alive and nothing more.
    Unconfigured = Number::PRIMARY_STATE_UNCONFIGURED,
    /// Ready, and idle.
    Inactive = Number::PRIMARY_STATE_INACTIVE,
    /// At work.
    Active = Number::PRIMARY_STATE_ACTIVE,
    /// At its end.
    Finalized = Number::PRIMARY_STATE_FINALIZED,
    /// On the way from unconfigured to inactive.
    Configuring = Number::TRANSITION_STATE_CONFIGURING,
    /// On the way from inactive to unconfigured.
    CleaningUp = Number::TRANSITION_STATE_CLEANINGUP,
    /// On the way to finalized.
    ShuttingDown = Number::TRANSITION_STATE_SHUTTINGDOWN,
    /// On the way from inactive to active.
    Activating = Number::TRANSITION_STATE_ACTIVATING,
    /// On the way from active to inactive.
    Deactivating = Number::TRANSITION_STATE_DEACTIVATING,
    /// Something has failed.
    ErrorProcessing = Number::TRANSITION_STATE_ERRORPROCESSING,
}

/// What can be asked of a managed node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// From unconfigured to inactive.
    Configure,
    /// From inactive to unconfigured.
    CleanUp,
    /// From inactive to active.
    Activate,
    /// From active to inactive.
    Deactivate,
    /// From any of these to finalized.
    Shutdown,
}

/// How a transition has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// As was asked.
    Success,
    /// The node is where it was before, or at its end.
    Failure,
    /// The node cannot go on like this.
    Error,
}

/// An edge of the graph of states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Edge {
    pub(super) id: u8,
    pub(super) label: &'static str,
    pub(super) start: State,
    pub(super) goal: State,
}

pub(super) const STATES: [State; 10] = [
    State::Unconfigured,
    State::Inactive,
    State::Active,
    State::Finalized,
    State::Configuring,
    State::CleaningUp,
    State::ShuttingDown,
    State::Activating,
    State::Deactivating,
    State::ErrorProcessing,
];

/// What can be asked for: the number of the transition (`lifecycle_msgs/msg/Transition`), where it starts, what it is, and
/// where it leads.
const ASKED: [(u8, State, Change, State); 7] = {
    use {Change::*, State::*};
    [
        (1, Unconfigured, Configure, Configuring),
        (2, Inactive, CleanUp, CleaningUp),
        (3, Inactive, Activate, Activating),
        (4, Active, Deactivate, Deactivating),
        (5, Unconfigured, Shutdown, ShuttingDown),
        (6, Inactive, Shutdown, ShuttingDown),
        (7, Active, Shutdown, ShuttingDown),
    ]
};

/// How it ends: the number of the success, after which come those of the failure and of the error; where the node is
/// meanwhile, after the success, and after the failure.
const ENDED: [(u8, State, State, State); 6] = {
    use State::*;
    [
        (10, Configuring, Inactive, Unconfigured),
        (20, CleaningUp, Unconfigured, Inactive),
        (30, Activating, Active, Inactive),
        (40, Deactivating, Inactive, Active),
        (50, ShuttingDown, Finalized, Finalized),
        (60, ErrorProcessing, Unconfigured, Finalized),
    ]
};

const OUTCOMES: [Outcome; 3] = [Outcome::Success, Outcome::Failure, Outcome::Error];

impl State {
    /// As ROS 2 calls it.
    pub fn label(self) -> &'static str {
        match self {
            Self::Unconfigured => "unconfigured",
            Self::Inactive => "inactive",
            Self::Active => "active",
            Self::Finalized => "finalized",
            Self::Configuring => "configuring",
            Self::CleaningUp => "cleaningup",
            Self::ShuttingDown => "shuttingdown",
            Self::Activating => "activating",
            Self::Deactivating => "deactivating",
            Self::ErrorProcessing => "errorprocessing",
        }
    }

    pub(super) fn message(self) -> messages::State {
        messages::State {
            id: self as u8,
            label: self.label().into(),
        }
    }

    /// What leads on from here when it is asked for.
    pub(super) fn changed(self, change: Change) -> Option<Edge> {
        self.changes()
            .find(|(asked, _)| *asked == change)
            .map(|(_, edge)| edge)
    }

    /// All that can be asked for here.
    fn changes(self) -> impl Iterator<Item = (Change, Edge)> {
        let rows = ASKED.into_iter().filter(move |row| row.1 == self);
        rows.map(|(id, start, change, goal)| {
            let label = change.label();
            (
                change,
                Edge {
                    id,
                    label,
                    start,
                    goal,
                },
            )
        })
    }

    /// What leads on from here when the transition has ended; errors of an active node lead to the processing of errors.
    pub(super) fn ended(self, outcome: Outcome) -> Option<Edge> {
        let found = ENDED.iter().find(|row| row.1 == self);
        let &(first, start, success, failure) = found?;
        let (id, goal) = match (outcome, self) {
            (Outcome::Success, _) => (first, success),
            (Outcome::Failure, _) => (first + 1, failure),
            (Outcome::Error, Self::ErrorProcessing) => (first + 2, Self::Finalized),
            (Outcome::Error, _) => (first + 2, Self::ErrorProcessing),
        };
        Some(Edge {
            id,
            label: outcome.label(),
            start,
            goal,
        })
    }

    /// All that leads on from here.
    pub(super) fn edges(self) -> impl Iterator<Item = Edge> {
        let changed = self.changes().map(|(_, edge)| edge);
        let ended = OUTCOMES
            .into_iter()
            .filter_map(move |outcome| self.ended(outcome));
        changed.chain(ended)
    }
}

impl Change {
    fn label(self) -> &'static str {
        match self {
            Self::Configure => "configure",
            Self::CleanUp => "cleanup",
            Self::Activate => "activate",
            Self::Deactivate => "deactivate",
            Self::Shutdown => "shutdown",
        }
    }

    /// What a client asks for, in a given state: by label if it gives one, else by number.
    pub(super) fn asked(transition: &messages::Transition, state: State) -> Option<Self> {
        let (id, label) = (transition.id, &transition.label);
        let meant = |edge: &Edge| {
            if label.is_empty() {
                edge.id == id
            } else {
                edge.label == label
            }
        };
        let found = state.changes().find(|(_, edge)| meant(edge));
        found.map(|(change, _)| change)
    }
}

impl Outcome {
    fn label(self) -> &'static str {
        match self {
            Self::Success => "transition_success",
            Self::Failure => "transition_failure",
            Self::Error => "transition_error",
        }
    }
}

impl Edge {
    pub(super) fn transition(self) -> messages::Transition {
        messages::Transition {
            id: self.id,
            label: self.label.into(),
        }
    }

    pub(super) fn description(self) -> messages::TransitionDescription {
        messages::TransitionDescription {
            transition: self.transition(),
            start_state: self.start.message(),
            goal_state: self.goal.message(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_graph_is_that_of_rcl_lifecycle() {
        let edges: Vec<_> = STATES.into_iter().flat_map(State::edges).collect();
        let of = |label: &str| {
            let found = edges.iter().filter(|edge| edge.label == label);
            found
                .map(|edge| (edge.id, edge.start.label(), edge.goal.label()))
                .collect::<Vec<_>>()
        };
        assert_eq!(of("configure"), [(1, "unconfigured", "configuring")]);
        assert_eq!(of("cleanup"), [(2, "inactive", "cleaningup")]);
        assert_eq!(of("activate"), [(3, "inactive", "activating")]);
        assert_eq!(of("deactivate"), [(4, "active", "deactivating")]);
        let shutdowns = [
            (5, "unconfigured", "shuttingdown"),
            (6, "inactive", "shuttingdown"),
            (7, "active", "shuttingdown"),
        ];
        assert_eq!(of("shutdown"), shutdowns);
        let successes = [
            (10, "configuring", "inactive"),
            (20, "cleaningup", "unconfigured"),
            (50, "shuttingdown", "finalized"),
            (30, "activating", "active"),
            (40, "deactivating", "inactive"),
            (60, "errorprocessing", "unconfigured"),
        ];
        assert_eq!(of("transition_success"), successes);
        let failures = [
            (11, "configuring", "unconfigured"),
            (21, "cleaningup", "inactive"),
            (51, "shuttingdown", "finalized"),
            (31, "activating", "inactive"),
            (41, "deactivating", "active"),
            (61, "errorprocessing", "finalized"),
        ];
        assert_eq!(of("transition_failure"), failures);
        let errors = of("transition_error");
        assert_eq!(errors.len(), 6);
        assert!(errors.contains(&(62, "errorprocessing", "finalized")));
        assert!(errors.contains(&(32, "activating", "errorprocessing")));
        assert_eq!(edges.len(), 7 + 18);
    }

    #[test]
    fn a_client_asks_by_label_or_by_number() {
        let ask = |id, label: &str, state| {
            let label = label.into();
            Change::asked(&messages::Transition { id, label }, state)
        };
        assert_eq!(ask(1, "", State::Unconfigured), Some(Change::Configure));
        assert_eq!(ask(1, "", State::Active), None);
        assert_eq!(
            ask(0, "configure", State::Unconfigured),
            Some(Change::Configure)
        );
        assert_eq!(ask(7, "", State::Active), Some(Change::Shutdown));
        assert_eq!(ask(5, "", State::Active), None);
        assert_eq!(ask(0, "shutdown", State::Inactive), Some(Change::Shutdown));
        assert_eq!(ask(1, "nonsense", State::Unconfigured), None);
        assert_eq!(ask(10, "", State::Configuring), None);
    }
}
