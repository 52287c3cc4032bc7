use std::collections::VecDeque;
use std::pin::pin;
use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::task::{Context, Poll};
use std::thread;
use std::time::{Duration, Instant};

use lgvi_dynamics::System;
use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::Subscription;
use lgvi_middleware::shm::{ControlSubscriber, FeedbackSubscriber};
use lgvi_middleware::thread_waker;
use lgvi_msgs::msg::{self, ControlLimits, ControlSequence, Intervention};
use lgvi_msgs::shm::{Limits, Name};
use lgvi_scene::Scene;
use rtrb::{Consumer, Producer};
use tracing::{error, info, warn};

use super::clock::FlightClock;
use super::late::Late;
use super::settling::Settling;
use super::topics::Topics;
use super::{Request, SEQUENCES, SNAPSHOTS, Shared};
use crate::messages::{self, Snapshot};
use crate::monitor::Monitor;
use crate::{ControlError, Controls};

/// How often the ROS side looks for work while states or controls may come.
const BUSY: Duration = Duration::from_millis(1);

/// The same while none are expected: for the first of a new publisher in shared memory, and for subscribers. What comes
/// over DDS, and what the loop asks, wakes it.
const IDLE: Duration = Duration::from_millis(50);

/// How long after the first copy of a sequence another may come by another way.
const WAYS: Duration = Duration::from_secs(1);

/// The thread's end of the link.
pub(super) struct Link {
    pub(super) scene: Arc<Scene>,
    /// For the potential in the invariants.
    pub(super) system: System,
    pub(super) names: Vec<Name>,
    pub(super) topics: Topics,
    pub(super) monitor: Arc<Monitor>,
    pub(super) shm_controls: ControlSubscriber,
    pub(super) shm_feedback: FeedbackSubscriber,
    pub(super) ros_controls: Subscription<ControlSequence>,
    pub(super) filled: Consumer<Snapshot>,
    pub(super) empty: Producer<Snapshot>,
    pub(super) controls: Producer<Arc<Controls>>,
    pub(super) verdicts: Consumer<Result<u64, ControlError>>,
    pub(super) requests: mpsc::Receiver<Request>,
    /// What the loop holds. Kept until it has let go, so that the memory is given back here and not by the loop.
    pub(super) held: Vec<Arc<Controls>>,
    /// Sequences that the loop has yet to answer.
    pub(super) pending: VecDeque<Arc<ControlSequence>>,
    /// The last sequences that came in, and when, so that what comes by two ways counts once.
    pub(super) recent: VecDeque<(Arc<ControlSequence>, Instant)>,
    /// The last sequences that were accepted before the first step: a flight that is reset begins with them again.
    pub(super) initial: VecDeque<Arc<ControlSequence>>,
    /// Whether feedback laws are flown.
    pub(super) feedback: bool,
    pub(super) stop_on_bad_control: bool,
    /// Sequences that came too late.
    pub(super) late: Late,
    /// What was published is waited for to be acknowledged.
    pub(super) settling: Option<Settling>,
    pub(super) shared: Arc<Shared>,
}

impl Link {
    /// Publishes what stays as it is, for late joiners: the scene, its frames and how it looks.
    pub(super) fn announce_scene(&mut self) -> Result<(), NodeError> {
        let scene = &self.scene;
        let message = msg::Scene {
            header: lgvi_common::header(scene, 0).map_err(NodeError::input)?,
            name: scene.name.clone(),
            text: scene.text.clone(),
            software: crate::SOFTWARE.into(),
        };
        self.topics.scene.send(&message);
        let markers = messages::markers(scene).map_err(NodeError::input)?;
        self.topics.markers.send(&markers);
        let frames = messages::static_transforms(scene).map_err(NodeError::input)?;
        if let (Some(topic), Some(frames)) = (&mut self.topics.tf_static, frames) {
            topic.send(&frames);
        }
        Ok(())
    }

    /// Serves the loop until it asks for the end.
    pub(super) fn serve(mut self, await_subscribers: usize) {
        let mut sequence = 0;
        let mut begun = false;
        let waker = thread_waker();
        let mut context = Context::from_waker(&waker);
        loop {
            let wanted = self.topics.wanted() || self.monitor.wanted();
            self.shared.wanted.store(wanted, Ordering::Release);
            if self.topics.have_subscribers(await_subscribers) {
                self.shared.attended.store(true, Ordering::Release);
            }
            // Taken before what was handed over before it.
            let request = match self.requests.try_recv() {
                Err(mpsc::TryRecvError::Disconnected) => return,
                request => request.ok(),
            };
            self.answer_pending();
            let received = self.receive_controls(&mut context);
            self.held.retain(|controls| Arc::strong_count(controls) > 1);
            let mut idle = request.is_none() && !received;
            // All that was there before the request, and not for ever.
            for _ in 0..SNAPSHOTS {
                let Ok(snapshot) = self.filled.pop() else {
                    break;
                };
                idle = false;
                begun = true;
                self.publish(&snapshot, &mut sequence);
                self.monitor.observe(snapshot.step, &snapshot.states);
                // As many places as snapshots.
                let _ = self.empty.push(snapshot);
            }
            if let Some(clock) = self.topics.clock.as_mut().filter(|_| begun) {
                let step = self.monitor.step.load(Ordering::Relaxed);
                match request {
                    Some(Request::Settle(..)) => clock.tell_last(&self.scene, step),
                    _ => clock.tell(&self.scene, step),
                }
            }
            // Who has asked may have gone.
            match request {
                Some(Request::Settle(patience, answer)) => {
                    self.answer_pending();
                    self.settling = Some(Settling::new(patience, answer));
                }
                Some(Request::Intervene(message, done)) => {
                    self.answer_pending();
                    self.intervene(&message);
                    let _ = done.send(());
                }
                Some(Request::Close) => return,
                None => {}
            }
            if let Some(settling) = &mut self.settling {
                idle = false;
                if settling.go_on(&self.topics.outgoing()) {
                    self.settling = None;
                }
            }
            if idle {
                thread::park_timeout(self.pause(wanted));
            }
        }
    }

    /// How long to pause at most where there is nothing to do, by whether states are wanted.
    fn pause(&self, wanted: bool) -> Duration {
        let expected = wanted
            || !self.shared.attended.load(Ordering::Relaxed)
            || !self.pending.is_empty()
            || self.shm_controls.publishers() + self.shm_feedback.publishers() > 0
            || self.topics.clock.as_ref().is_some_and(FlightClock::wanted);
        if expected { BUSY } else { IDLE }
    }

    /// Publishes that the course has been changed. A new one begins with the sequences with which the first has begun.
    fn intervene(&mut self, message: &Intervention) {
        self.topics.intervention.send(message);
        if message.kind == Intervention::RESET {
            self.recent.retain(|(_, at)| at.elapsed() < WAYS);
            for message in std::mem::take(&mut self.initial) {
                self.check(message);
            }
        }
    }

    /// Publishes what somebody has subscribed to.
    fn publish(&mut self, snapshot: &Snapshot, sequence: &mut u64) {
        let (scene, topics) = (&self.scene, &mut self.topics);
        // A scene's stamps all fit ROS time: it was checked when it was compiled.
        if topics.state.wanted()
            && let Ok(message) = messages::system_state(scene, &self.names, snapshot, *sequence)
        {
            topics.state.send(&message);
            *sequence += 1;
        }
        for (body, topic) in topics.odometry.iter_mut().enumerate() {
            if topic.wanted()
                && let Ok(message) = messages::odometry(scene, body, snapshot)
            {
                topic.send(&message);
            }
        }
        if topics.tf.wanted()
            && let Ok(message) = messages::transforms(scene, snapshot)
        {
            topics.tf.send(&message);
        }
        if topics.invariants.wanted()
            && let Ok(message) = messages::invariants(scene, &self.system, snapshot)
        {
            if message.energy.is_finite() {
                topics.invariants.send(&message);
            } else {
                let fault = format!("step {}: the energy is not finite", snapshot.step);
                let _ = self.shared.fault.set(fault);
            }
        }
    }

    /// Considers the sequences that have come in; returns whether there were any.
    fn receive_controls(&mut self, context: &mut Context<'_>) -> bool {
        let frame = &self.scene.frame;
        let mut any = false;
        let controls = self.shm_controls.receive();
        let controls =
            controls.map(|sample| sample.map(|s| s.header().to_message(s.elements(), frame)));
        let feedback = self.shm_feedback.receive();
        let feedback =
            feedback.map(|sample| sample.map(|s| s.header().to_message(s.elements(), frame)));
        for received in [controls, feedback] {
            any |= matches!(received, Ok(Some(_)));
            match received {
                Ok(Some(Ok(message))) => self.consider(message),
                Ok(Some(Err(error))) => self.refuse(error.into()),
                Ok(None) => {}
                Err(error) => warn!("{error}"),
            }
        }
        let received = pin!(self.ros_controls.recv()).poll(context);
        any |= received.is_ready();
        match received {
            Poll::Ready(Ok(sample)) => self.consider(sample.message),
            Poll::Ready(Err(error)) => self.refuse(ControlError::Undecodable(error.to_string())),
            Poll::Pending => {}
        }
        any
    }

    /// Checks a sequence that came in, unless it has come by another way.
    fn consider(&mut self, message: ControlSequence) {
        if self.recent.iter().any(|(recent, _)| **recent == message) {
            return;
        }
        let message = Arc::new(message);
        self.recent.truncate(SEQUENCES - 1);
        self.recent
            .push_front((Arc::clone(&message), Instant::now()));
        if !self.check(message) {
            self.recent.pop_front();
        }
    }

    /// Checks a sequence and sends it to the loop; `false` where too many wait already.
    fn check(&mut self, message: Arc<ControlSequence>) -> bool {
        match Controls::of_message(&self.scene, &message) {
            Ok(controls) if self.feedback => self.send(controls, message),
            Ok(controls) => self.send(controls.open_loop(), Arc::new(open_loop(&message))),
            Err(error) => {
                self.refuse(error);
                true
            }
        }
    }

    /// Sends a sequence to the loop; `message` is what it will be said to fly.
    fn send(&mut self, controls: Controls, message: Arc<ControlSequence>) -> bool {
        let controls = Arc::new(controls);
        let sent = self.controls.push(Arc::clone(&controls)).is_ok();
        if sent {
            self.held.push(controls);
            self.pending.push_back(message);
        } else {
            warn!("control sequence refused: {SEQUENCES} others wait to be taken up");
        }
        sent
    }

    /// A malformed sequence ends the flight, or is refused with an error in the log.
    fn refuse(&mut self, error: ControlError) {
        error!("control sequence refused: {error}");
        if self.stop_on_bad_control {
            let _ = self.shared.bad_control.set(error);
        }
    }

    /// Publishes the sequences that the loop has accepted: they are what is flown.
    fn answer_pending(&mut self) {
        while let Ok(verdict) = self.verdicts.pop() {
            let Some(message) = self.pending.pop_front() else {
                return;
            };
            match verdict {
                Ok(step) => {
                    info!(
                        "flying a control sequence for {} from step {}",
                        message.body, message.first_step
                    );
                    self.topics.flown.send(&message);
                    if step == 0 {
                        if self.initial.len() == SEQUENCES {
                            self.initial.pop_front();
                        }
                        self.initial.push_back(message);
                    }
                }
                Err(error @ ControlError::Late { .. }) => {
                    if let Some(warning) = self.late.note(&error, Instant::now()) {
                        warn!("{warning}");
                    }
                }
                Err(error) => warn!("control sequence refused: {error}"),
            }
        }
    }
}

/// The sequence without its feedback law.
fn open_loop(message: &ControlSequence) -> ControlSequence {
    ControlSequence {
        reference: Vec::new(),
        feedback: Vec::new(),
        limits: ControlLimits::from(&Limits::NONE),
        ..message.clone()
    }
}
