use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::Duration;

use lgvi_dynamics::BodyState;
use lgvi_middleware::Shutdown;
use lgvi_node::NodeError;
use rtrb::{Consumer, Producer};

use super::{Published, Shared};
use crate::messages::Snapshot;
use crate::{ControlError, Controls};

/// The loop's end of the link.
pub(crate) struct LinkEnd {
    pub(super) filled: Producer<Snapshot>,
    pub(super) empty: Consumer<Snapshot>,
    pub(super) controls: Consumer<Arc<Controls>>,
    pub(super) verdicts: Producer<Result<(), ControlError>>,
    pub(super) published: mpsc::Receiver<Published>,
    pub(super) shared: Arc<Shared>,
    pub(super) thread: JoinHandle<()>,
    pub(super) shutdown: Shutdown,
}

impl LinkEnd {
    /// Takes the next control sequence that has come in.
    pub(crate) fn next_controls(&mut self) -> Option<Arc<Controls>> {
        self.controls.pop().ok()
    }

    /// Says what became of it.
    pub(crate) fn answer(&mut self, verdict: Result<(), ControlError>) {
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

    /// Hands a snapshot to the ROS side. When none is free, waits if `wait`, else returns `false`.
    pub(crate) fn publish(&mut self, step: u64, states: &[BodyState], wait: bool) -> bool {
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

    /// Waits until what was handed over is published and acknowledged, or given up; what was published, by topic.
    pub(crate) fn finish(&self) -> Result<Published, NodeError> {
        self.shared.finish.store(true, Ordering::Release);
        self.published
            .recv()
            .map_err(|_| NodeError::runtime("the ROS side has panicked"))
    }

    /// Keeps the topics for late joiners until the shutdown.
    pub(crate) fn linger(self) -> Result<(), NodeError> {
        self.thread
            .join()
            .map_err(|_| NodeError::runtime("the ROS side has panicked"))
    }
}
