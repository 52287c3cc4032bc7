//! Managed nodes: what state a node is in, and who may change it.

mod machine;

use std::{
    collections::VecDeque,
    sync::{
        Arc, Condvar, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use lgvi_msgs::lifecycle_msgs::{
    TransitionEvent,
    srv::{
        ChangeState, ChangeStateResponse, GetAvailableStates, GetAvailableStatesResponse,
        GetAvailableTransitions, GetAvailableTransitionsResponse, GetState, GetStateResponse,
    },
};
use tracing::warn;

use crate::{
    sync::{lock, wait_while},
    wall,
};

use super::{Executor, Publisher, Qos, Reply, RosError, RosNode};
use machine::{Edge, STATES};

pub use machine::{Change, Outcome, State};

/// Transition events that are kept for those who do not keep up.
const EVENTS: usize = 10;

/// The state of a managed node. Clones are handles to the same.
///
/// Clients ask for changes by the service `~/change_state`; the node's own thread takes what is asked by
/// [`next`](Self::next), does it, and says how it has ended. Others see the state by `~/get_state`,
/// `~/get_available_states`, `~/get_available_transitions`, `~/get_transition_graph` and `~/transition_event`.
#[derive(Clone)]
pub struct Lifecycle(Arc<Shared>);

struct Shared {
    inner: Mutex<Inner>,
    /// Something has been asked for.
    asked: AtomicBool,
    arrived: Condvar,
    events: Publisher<TransitionEvent>,
}

struct Inner {
    state: State,
    asked: VecDeque<Asked>,
}

/// A change that a client has asked for.
pub struct Asked {
    /// What it is. It can be made in the state that the node was in when it was asked.
    pub change: Change,
    reply: Reply<ChangeState>,
}

impl Lifecycle {
    /// Unconfigured; offers the services and the topic.
    pub fn serve(node: &RosNode, executor: &mut Executor) -> Result<Self, RosError> {
        let lifecycle = Self(Arc::new(Shared {
            inner: Mutex::new(Inner {
                state: State::Unconfigured,
                asked: VecDeque::new(),
            }),
            asked: AtomicBool::new(false),
            arrived: Condvar::new(),
            events: node.publisher("~/transition_event", &Qos::reliable(EVENTS))?,
        }));
        let this = lifecycle.clone();
        executor.serve::<ChangeState>(node, "~/change_state", move |request, reply| {
            this.ask(&request.transition, reply);
        })?;
        let this = lifecycle.clone();
        executor.answer::<GetState>(node, "~/get_state", move |_| GetStateResponse {
            current_state: this.state().message(),
        })?;
        executor.answer::<GetAvailableStates>(node, "~/get_available_states", |_| {
            let available_states = known_states().collect();
            GetAvailableStatesResponse { available_states }
        })?;
        let this = lifecycle.clone();
        let available = "~/get_available_transitions";
        executor.answer::<GetAvailableTransitions>(node, available, move |_| {
            transitions([this.state()])
        })?;
        let graph = "~/get_transition_graph";
        executor.answer::<GetAvailableTransitions>(node, graph, |_| transitions(STATES))?;
        Ok(lifecycle)
    }

    /// The present state.
    pub fn state(&self) -> State {
        lock(&self.0.inner).state
    }

    /// Whether a change has been asked for that nobody has taken yet. Does not lock.
    pub fn asked(&self) -> bool {
        self.0.asked.load(Ordering::Acquire)
    }

    /// Takes the next change that has been asked for and can still be made; waits for one up to `timeout`.
    pub fn next(&self, timeout: Duration) -> Option<Asked> {
        let Shared { inner, arrived, .. } = &*self.0;
        let mut inner = wait_while(arrived, inner, timeout, |inner| inner.asked.is_empty());
        let asked = inner.asked.pop_front();
        self.0
            .asked
            .store(!inner.asked.is_empty(), Ordering::Release);
        let asked = asked?;
        if inner.state.changed(asked.change).is_some() {
            return Some(asked);
        }
        drop(inner);
        asked.answer(false);
        None
    }

    /// Enters the state that leads to the change; `false`, with no effect, where the change cannot be made.
    pub fn begin(&self, change: Change) -> bool {
        self.go(|state| state.changed(change))
    }

    /// Leaves the state that leads to a change, which has ended so; `false`, with no effect, in a primary state.
    pub fn end(&self, outcome: Outcome) -> bool {
        self.go(|state| state.ended(outcome))
    }

    fn go(&self, edge: impl FnOnce(State) -> Option<Edge>) -> bool {
        let mut inner = lock(&self.0.inner);
        let Some(edge) = edge(inner.state) else {
            return false;
        };
        inner.state = edge.goal;
        drop(inner);
        let event = TransitionEvent {
            timestamp: wall::now().unsigned_abs(),
            transition: edge.transition(),
            start_state: edge.start.message(),
            goal_state: edge.goal.message(),
        };
        if let Err(error) = self.0.events.publish(&event) {
            warn!("{error}");
        }
        true
    }

    fn ask(&self, transition: &lgvi_msgs::lifecycle_msgs::Transition, reply: Reply<ChangeState>) {
        let mut inner = lock(&self.0.inner);
        let state = inner.state;
        let Some(change) = Change::asked(transition, state) else {
            drop(inner);
            let (id, label) = (transition.id, &transition.label);
            warn!(
                "transition {label:?} ({id}) refused: the node is {}",
                state.label()
            );
            return reply.send(&ChangeStateResponse { success: false });
        };
        inner.asked.push_back(Asked { change, reply });
        self.0.asked.store(true, Ordering::Release);
        self.0.arrived.notify_all();
    }
}

impl Asked {
    /// Says whether it has been done.
    pub fn answer(self, success: bool) {
        self.reply.send(&ChangeStateResponse { success });
    }
}

/// `unknown`, in which no node is, and the others.
fn known_states() -> impl Iterator<Item = lgvi_msgs::lifecycle_msgs::State> {
    let unknown = lgvi_msgs::lifecycle_msgs::State {
        id: lgvi_msgs::lifecycle_msgs::State::PRIMARY_STATE_UNKNOWN,
        label: "unknown".into(),
    };
    std::iter::once(unknown).chain(STATES.into_iter().map(State::message))
}

fn transitions(states: impl IntoIterator<Item = State>) -> GetAvailableTransitionsResponse {
    GetAvailableTransitionsResponse {
        available_transitions: states
            .into_iter()
            .flat_map(State::edges)
            .map(Edge::description)
            .collect(),
    }
}
