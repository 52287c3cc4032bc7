use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::Duration;

use lgvi_dynamics::BodyState;
use lgvi_middleware::Shutdown;
use lgvi_middleware::ros::{Diagnosed, Diagnostics};
use lgvi_msgs::msg::Intervention;
use lgvi_node::{Node, NodeError};
use rtrb::{Consumer, Producer};

use super::counted::{self, Counts};
use super::{Published, Request, Shared};
use crate::messages::Snapshot;
use crate::{ControlError, Controls};

/// How often waiting for the thread looks whether the node is to stop.
const LOOK: Duration = Duration::from_millis(10);

/// Whether a state may be dropped when the ROS side is busy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wait {
    /// Where the flight has to be on time.
    AsConfigured,
    /// Never; a state is published where its turn has come.
    ForRoom,
    /// Never; the state is published in any case.
    Always,
}

/// The loop's end of the link.
pub(crate) struct LinkEnd {
    pub(super) filled: Producer<Snapshot>,
    pub(super) empty: Consumer<Snapshot>,
    pub(super) controls: Consumer<Arc<Controls>>,
    pub(super) verdicts: Producer<Result<u64, ControlError>>,
    pub(super) requests: mpsc::Sender<Request>,
    pub(super) counts: Vec<Arc<Counts>>,
    pub(super) lossless: bool,
    pub(super) shared: Arc<Shared>,
    pub(super) thread: JoinHandle<()>,
    pub(super) shutdown: Shutdown,
}

impl LinkEnd {
    /// Takes the next control sequence that has come in.
    pub(crate) fn next_controls(&mut self) -> Option<Arc<Controls>> {
        self.controls.pop().ok()
    }

    /// Says what became of it: the step at which it was accepted, or why it was not.
    pub(crate) fn answer(&mut self, verdict: Result<u64, ControlError>) {
        // There are as many places as sequences can be under way.
        let _ = self.verdicts.push(verdict);
    }

    /// The malformed control sequence that ends the flight, if one came in.
    pub(crate) fn bad_control(&self) -> Option<&ControlError> {
        self.shared.bad_control.get()
    }

    /// What ends the flight because it must not be published.
    pub(crate) fn fault(&self) -> Option<&str> {
        self.shared.fault.get().map(String::as_str)
    }

    /// Hands a snapshot to the ROS side, where somebody wants it; returns `false` where none is free and it may be dropped.
    pub(crate) fn publish(&mut self, step: u64, states: &[BodyState], wait: Wait) -> bool {
        if wait == Wait::AsConfigured && !self.shared.wanted.load(Ordering::Acquire) {
            return true;
        }
        let wait = self.lossless || wait != Wait::AsConfigured;
        let mut snapshot = loop {
            match self.empty.pop() {
                Ok(snapshot) => break snapshot,
                Err(_) if !wait || self.shutdown.requested() => return false,
                Err(_) => std::thread::sleep(Duration::from_micros(50)),
            }
        };
        snapshot.step = step;
        snapshot.states.copy_from_slice(states);
        self.filled.push(snapshot).is_ok()
    }

    /// Whether the ROS side has the subscribers that were asked for.
    pub(crate) fn attended(&self) -> bool {
        self.shared.attended.load(Ordering::Acquire)
    }

    /// Waits until what was handed over is published and acknowledged, or given up after `patience`; what was published,
    /// by topic.
    pub(crate) fn settle(&self, patience: Duration) -> Result<Published, NodeError> {
        let (answer, published) = mpsc::channel();
        self.ask(Request::Settle(patience, answer))?;
        published.recv().map_err(panicked)
    }

    /// Publishes that the course has been changed; waits until that is done, unless the node is to stop.
    pub(crate) fn intervene(&self, message: Intervention, node: &Node) -> Result<(), NodeError> {
        let (answer, done) = mpsc::channel();
        self.ask(Request::Intervene(Box::new(message), answer))?;
        while !node.interrupted() {
            match done.recv_timeout(LOOK) {
                Err(mpsc::RecvTimeoutError::Timeout) => {}
                done => return done.map_err(panicked),
            }
        }
        Ok(())
    }

    /// Has the topics on `/diagnostics`.
    pub(crate) fn diagnose(&self, diagnostics: &Diagnostics) -> Diagnosed {
        counted::diagnose(self.counts.clone(), diagnostics)
    }

    /// Closes the topics.
    pub(crate) fn close(self) -> Result<(), NodeError> {
        self.ask(Request::Close)?;
        self.thread.join().map_err(panicked)
    }

    fn ask(&self, request: Request) -> Result<(), NodeError> {
        self.requests.send(request).map_err(panicked)?;
        self.thread.thread().unpark();
        Ok(())
    }
}

fn panicked<E>(_: E) -> NodeError {
    NodeError::runtime("the ROS side has panicked")
}
