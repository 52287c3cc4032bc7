use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::task::Context;
use std::thread;
use std::time::{Duration, Instant};

use lgvi_common::Limits;
use lgvi_dynamics::System;
use lgvi_middleware::node::NodeError;
use lgvi_middleware::thread_waker;
use lgvi_msgs::msg::{self, ControlSequence, Intervention};
use lgvi_msgs::shm::Name;
use lgvi_scene::Scene;
use rtrb::{Consumer, Producer};
use tracing::{error, info, warn};

use super::clock::FlightClock;
use super::commands::Commands;
use super::late::Late;
use super::sequences::Sequences;
use super::settling::Settling;
use super::topics::Topics;
use super::{READINGS, Request, SEQUENCES, SNAPSHOTS, Shared, Verdict};
use crate::node::messages::{self, Snapshot};
use crate::node::monitor::Monitor;
use crate::{ControlError, Controls};

/// How often the ROS side looks for work while states or controls may come.
const BUSY: Duration = Duration::from_millis(1);

/// The same while none are expected: for the first of a new publisher in shared memory, and for subscribers. What comes
/// over DDS, and what the loop asks, wakes it.
const IDLE: Duration = Duration::from_millis(50);

/// The thread's end of the link.
pub(super) struct Link {
    pub(super) scene: Arc<Scene>,
    /// For the invariants, and for what actuators change.
    pub(super) system: System,
    pub(super) names: Vec<Name>,
    pub(super) topics: Topics,
    pub(super) monitor: Arc<Monitor>,
    pub(super) sequences: Sequences,
    pub(super) filled: Consumer<Snapshot>,
    pub(super) empty: Producer<Snapshot>,
    pub(super) controls: Producer<Arc<Controls>>,
    pub(super) verdicts: Consumer<Verdict>,
    pub(super) commands: Commands,
    pub(super) requests: mpsc::Receiver<Request>,
    /// What the loop holds. Kept until it has let go, so that the memory is given back here and not by the loop.
    pub(super) held: Vec<Arc<Controls>>,
    /// Sequences that the loop has yet to answer.
    pub(super) pending: VecDeque<Arc<ControlSequence>>,
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
            // Asked first: who else listens by then is known when the flight begins.
            let attended = self.topics.have_subscribers(await_subscribers);
            let wanted = self.topics.wanted() || self.monitor.wanted();
            self.shared.wanted.store(wanted, Ordering::Release);
            let wanted = self.topics.sensors.wanted(&self.shared.listened) || wanted;
            if attended {
                self.shared.attended.store(true, Ordering::Release);
            }
            // Taken before what was handed over before it.
            let request = match self.requests.try_recv() {
                Err(mpsc::TryRecvError::Disconnected) => return,
                request => request.ok(),
            };
            self.answer_pending();
            let received = self.receive_controls(&mut context)
                | self.commands.receive(&self.scene, &mut context);
            self.held.retain(|controls| Arc::strong_count(controls) > 1);
            let mut idle = request.is_none() && !received;
            // All that was there before the request, and not for ever.
            for _ in 0..SNAPSHOTS {
                let Ok(snapshot) = self.filled.pop() else {
                    break;
                };
                idle = false;
                begun = true;
                // What sensors have read at its step was handed over before.
                self.topics.sensors.publish(&self.scene, READINGS);
                self.publish(&snapshot, &mut sequence);
                self.monitor.observe(&snapshot);
                // As many places as snapshots.
                let _ = self.empty.push(snapshot);
            }
            idle &= !self.topics.sensors.publish(&self.scene, READINGS);
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
                    if let Some(warning) = self.late.rest() {
                        warn!("{warning}");
                    }
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
            || self.sequences.publishers() > 0
            || self.topics.clock.as_ref().is_some_and(FlightClock::wanted);
        if expected { BUSY } else { IDLE }
    }

    /// Publishes that the course has been changed. A new one begins with the sequences with which the first has begun.
    fn intervene(&mut self, message: &Intervention) {
        self.topics.intervention.send(message);
        if message.kind == Intervention::RESET {
            for message in std::mem::take(&mut self.initial) {
                self.check(message);
            }
        }
    }

    /// Publishes what somebody has subscribed to.
    fn publish(&mut self, snapshot: &Snapshot, sequence: &mut u64) {
        let (scene, topics) = (&self.scene, &mut self.topics);
        // A scene's stamps all fit ROS time: it was checked when it was compiled.
        if !snapshot.again
            && topics.state.wanted()
            && let Ok(message) = messages::system_state(scene, &self.names, snapshot, *sequence)
        {
            topics.state.send(&message);
            *sequence += 1;
        }
        self.system.set_actuator_states(&snapshot.actuators);
        for (body, topic) in &mut topics.joints {
            if topic.wanted()
                && let Ok(message) = messages::joint_state(scene, &self.system, *body, snapshot)
            {
                topic.send(&message);
            }
        }
        for (body, topic) in &mut topics.thrusters {
            if topic.wanted()
                && let Ok(message) = messages::thruster_states(scene, &self.system, *body, snapshot)
            {
                topic.send(&message);
            }
        }
        for (body, topic) in &mut topics.inertias {
            if topic.wanted()
                && let Ok(message) = messages::inertia(scene, &self.system, *body, snapshot)
            {
                topic.send(&message);
            }
        }
        for (body, topic) in topics.odometry.iter_mut().enumerate() {
            let rigid = &self.system.bodies()[body];
            if topic.wanted()
                && let Ok(message) = messages::odometry(scene, rigid, body, snapshot)
            {
                topic.send(&message);
            }
        }
        if snapshot.again {
            return;
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
        let mut any = false;
        for received in self.sequences.receive(context) {
            any = true;
            match received {
                Ok((arrival, _)) if self.sequences.is_copy(arrival) => {}
                Ok((arrival, message)) => {
                    if self.check(Arc::new(message)) {
                        self.sequences.expect_copy(arrival);
                    }
                }
                Err(error) => self.refuse(error),
            }
        }
        any
    }

    /// Checks a sequence and sends it to the loop; `false` where too many wait already.
    fn check(&mut self, message: Arc<ControlSequence>) -> bool {
        match Controls::of_message(&self.scene, &message) {
            Ok(controls) if self.feedback => self.send(controls, message),
            Ok(controls) => self.send(
                controls.open_loop(),
                Arc::new(open_loop(&self.scene, &message)),
            ),
            Err(error) => {
                self.refuse(error);
                true
            }
        }
    }

    /// Sends a sequence to the loop; `message` is what it will be said to fly.
    fn send(&mut self, controls: Controls, message: Arc<ControlSequence>) -> bool {
        let controls = Arc::new(controls);
        // The loop has a place for the verdict on each that is pending.
        let sent =
            self.pending.len() < SEQUENCES && self.controls.push(Arc::clone(&controls)).is_ok();
        if sent {
            self.held.push(controls);
            self.pending.push_back(message);
        } else {
            warn!("control sequence refused: {SEQUENCES} others are waiting");
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
            let verdict = match verdict {
                Verdict::Answer(verdict) => verdict,
                Verdict::Flown(message) => {
                    self.topics.flown.send(&message);
                    continue;
                }
            };
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
fn open_loop(scene: &Scene, message: &ControlSequence) -> ControlSequence {
    ControlSequence {
        reference: Vec::new(),
        feedback: Vec::new(),
        limits: Limits::NONE.to_si(&scene.units),
        ..message.clone()
    }
}
