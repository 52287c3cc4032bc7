use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::Duration;

use lgvi_middleware::Shutdown;
use lgvi_middleware::node::{Node, NodeError};
use lgvi_middleware::ros::{Diagnosed, Diagnostics};
use lgvi_msgs::msg::{ControlSequence, Intervention};
use rtrb::{Consumer, Producer};

use super::counted::{self, Counts};
use super::{LinkError, Published, Request, SEQUENCES, Shared, Verdict};
use crate::node::command::Command;
use crate::node::messages::Snapshot;
use crate::node::sensors::{Listened, Reading};
use crate::{ControlError, Controls, Flight};

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
    pub(super) verdicts: Producer<Verdict>,
    pub(super) commands: Consumer<Command>,
    pub(super) readings: Producer<Reading>,
    pub(super) requests: mpsc::Sender<Request>,
    pub(super) counts: Vec<Arc<Counts>>,
    pub(super) lossless: Arc<AtomicBool>,
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
        // There is a place for each sequence that is pending.
        let _ = self.verdicts.push(Verdict::Answer(verdict));
    }

    /// Takes the next command that has come in, if what it and `others` become can be published.
    pub(crate) fn next_command(&mut self, others: usize) -> Option<Command> {
        if self.verdicts.slots() <= SEQUENCES + others {
            return None;
        }
        self.commands.pop().ok()
    }

    /// Whether a sequence that is flown from here on can be published.
    pub(crate) fn has_room(&self) -> bool {
        self.verdicts.slots() > SEQUENCES
    }

    /// Forgets the commands that have come in.
    pub(crate) fn forget_commands(&mut self) {
        while self.commands.pop().is_ok() {}
    }

    /// Has a sequence published that a command has become, or that has answered a state.
    pub(crate) fn flies(&mut self, sequence: ControlSequence) {
        // There is a place: see `next_command` and `has_room`.
        let _ = self.verdicts.push(Verdict::Flown(Box::new(sequence)));
    }

    /// Has the thread look for what was handed over, for somebody waits for an answer.
    pub(crate) fn wake(&self) {
        self.thread.thread().unpark();
    }

    /// Whether the flight can go on.
    pub(crate) fn check(&self) -> Result<(), LinkError> {
        if let Some(error) = self.shared.bad_control.get() {
            return Err(LinkError::BadControl(error.clone()));
        }
        self.check_published()?;
        if self.filled.is_abandoned() {
            return Err(LinkError::Ended);
        }
        Ok(())
    }

    /// Whether all that had to be published could be.
    pub(crate) fn check_published(&self) -> Result<(), LinkError> {
        let fault = self.shared.fault.get().cloned();
        fault.map_or(Ok(()), |fault| Err(LinkError::Fault(fault)))
    }

    /// Loses nothing from here on, or nobody is waited for.
    pub(crate) fn set_lossless(&self, lossless: bool) {
        self.lossless.store(lossless, Ordering::Relaxed);
    }

    /// Hands a snapshot to the ROS side, where somebody wants it; returns `false` where none is free and it may be dropped.
    pub(crate) fn publish(&mut self, flight: &Flight, wait: Wait) -> bool {
        if wait == Wait::AsConfigured && !self.shared.wanted.load(Ordering::Acquire) {
            return true;
        }
        let wait = self.lossless.load(Ordering::Relaxed) || wait != Wait::AsConfigured;
        let mut snapshot = loop {
            match self.empty.pop() {
                Ok(snapshot) => break snapshot,
                Err(_) if !wait || self.shutdown.requested() || self.filled.is_abandoned() => {
                    return false;
                }
                Err(_) => std::thread::sleep(Duration::from_micros(50)),
            }
        };
        snapshot.take(flight);
        snapshot.again = false;
        self.filled.push(snapshot).is_ok()
    }

    /// Whether somebody listens to each sensor.
    pub(crate) fn listened(&self) -> Listened {
        Arc::clone(&self.shared.listened)
    }

    /// Hands what a sensor has read to the ROS side; returns `false` where there is no room and it may be dropped.
    pub(crate) fn sense(&mut self, reading: Reading, wait: Wait) -> bool {
        let wait = self.lossless.load(Ordering::Relaxed) || wait != Wait::AsConfigured;
        while self.readings.is_full() {
            if !wait || self.shutdown.requested() || self.readings.is_abandoned() {
                return false;
            }
            std::thread::sleep(Duration::from_micros(50));
        }
        self.readings.push(reading).is_ok()
    }

    /// Has the odometry of a state published once more, for those who have come since.
    pub(crate) fn repeat(&mut self, flight: &Flight) {
        if let Ok(mut snapshot) = self.empty.pop() {
            snapshot.take(flight);
            snapshot.again = true;
            let _ = self.filled.push(snapshot);
            self.wake();
        }
    }

    /// Whether the ROS side has the subscribers that were asked for.
    pub(crate) fn attended(&self) -> bool {
        self.shared.attended.load(Ordering::Acquire)
    }

    /// Has what was handed over published and acknowledged, or given up after `patience`. What comes then is what was
    /// published, by topic.
    pub(crate) fn settle(
        &self,
        patience: Duration,
    ) -> Result<mpsc::Receiver<Published>, LinkError> {
        let (answer, published) = mpsc::channel();
        self.ask(Request::Settle(patience, answer))?;
        Ok(published)
    }

    /// Publishes that the course has been changed; waits until that is done, unless the node is to stop.
    pub(crate) fn intervene(&self, message: Intervention, node: &Node) -> Result<(), NodeError> {
        let (answer, done) = mpsc::channel();
        self.ask(Request::Intervene(Box::new(message), answer))?;
        while !node.interrupted() {
            match done.recv_timeout(LOOK) {
                Err(mpsc::RecvTimeoutError::Timeout) => {}
                done => return done.map_err(|_| LinkError::Ended.into()),
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
        self.thread.join().map_err(|_| LinkError::Ended.into())
    }

    fn ask(&self, request: Request) -> Result<(), LinkError> {
        self.requests.send(request).map_err(|_| LinkError::Ended)?;
        self.thread.thread().unpark();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use lgvi_scene::Scene;
    use rtrb::RingBuffer;

    use super::*;
    use crate::flight;
    use crate::node::messages::Snapshot;

    /// The loop's end of a link whose thread has panicked, with one snapshot left.
    fn orphaned(scene: &Scene) -> LinkEnd {
        let (filled, other_filled) = RingBuffer::new(1);
        let (mut other_empty, empty) = RingBuffer::new(1);
        let (other_controls, controls) = RingBuffer::new(1);
        let (verdicts, other_verdicts) = RingBuffer::new(1);
        let (other_commands, commands) = RingBuffer::new(1);
        let (readings, other_readings) = RingBuffer::new(1);
        let (requests, other_requests) = mpsc::channel();
        other_empty.push(Snapshot::new(scene)).unwrap();
        let shared = Arc::new(Shared::default());
        shared.wanted.store(true, Ordering::Release);
        let thread = std::thread::spawn(move || {
            let _ends = (
                other_filled,
                other_empty,
                other_controls,
                other_verdicts,
                other_commands,
                other_readings,
                other_requests,
            );
            panic!("as a fault of the ROS side does");
        });
        while !thread.is_finished() {
            std::thread::yield_now();
        }
        LinkEnd {
            filled,
            empty,
            controls,
            verdicts,
            commands,
            readings,
            requests,
            counts: Vec::new(),
            lossless: Arc::new(AtomicBool::new(true)),
            shared,
            thread,
            shutdown: Shutdown::new(),
        }
    }

    #[test]
    fn a_flight_whose_ros_side_has_died_neither_hangs_nor_goes_on() {
        let scene = flight::tests::scene();
        let flight = Flight::new(&scene).unwrap();
        let mut link = orphaned(&scene);
        assert!(link.publish(&flight, Wait::AsConfigured));
        assert!(!link.publish(&flight, Wait::AsConfigured));
        assert!(!link.publish(&flight, Wait::Always));
        assert!(matches!(link.check(), Err(LinkError::Ended)));
        assert!(matches!(link.settle(Duration::ZERO), Err(LinkError::Ended)));
        assert!(link.close().is_err());
    }
}
