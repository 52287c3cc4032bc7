//! The second thread: the node's ROS side, and the controls that come in over shared memory or DDS.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock, mpsc};
use std::thread::JoinHandle;
use std::time::Duration;

use lgvi_dynamics::{BodyState, Simulation};
use lgvi_middleware::Shutdown;
use lgvi_middleware::ros::{PublishError, Publisher, Qos, RosNode, Subscription};
use lgvi_middleware::shm::{ControlSubscriber, ShmNode};
use lgvi_msgs::RosMessage;
use lgvi_msgs::msg::{self, ControlSequence, SystemState};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::shm::{ControlHeader, Name};
use lgvi_msgs::tf2_msgs::TFMessage;
use lgvi_node::NodeError;
use lgvi_scene::Scene;
use rtrb::{Consumer, Producer, RingBuffer};
use tracing::{error, info, warn};

use crate::config::{Config, PATIENCE};
use crate::messages::{self, Snapshot};
use crate::{ControlError, Controls};

/// Snapshots between the loop and the ROS side.
const SNAPSHOTS: usize = 64;

/// Control sequences on their way to the loop.
const SEQUENCES: usize = 8;

/// How often the ROS side looks for work when there is none.
const IDLE: Duration = Duration::from_millis(1);

/// Depth of the topics that stream.
const STREAM_DEPTH: usize = 1000;

/// The loop's end of the link.
pub(crate) struct LinkEnd {
    filled: Producer<Snapshot>,
    empty: Consumer<Snapshot>,
    controls: Consumer<Controls>,
    verdicts: Producer<Result<(), ControlError>>,
    published: mpsc::Receiver<Published>,
    shared: Arc<Shared>,
    thread: JoinHandle<()>,
    shutdown: Shutdown,
}

/// Messages published, by topic.
pub(crate) type Published = BTreeMap<String, u64>;

#[derive(Default)]
struct Shared {
    /// Odometry, tf and invariants have the subscribers that were asked for.
    attended: AtomicBool,
    /// The loop has ended: publish what is queued, then report.
    finish: AtomicBool,
    /// A control sequence was malformed.
    bad_control: OnceLock<ControlError>,
    /// Something that must not be published.
    fault: OnceLock<String>,
}

impl LinkEnd {
    /// Takes the next control sequence that has come in.
    pub(crate) fn next_controls(&mut self) -> Option<Controls> {
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

/// A publisher with the number of messages it has sent.
struct Counted<M> {
    publisher: Publisher<M>,
    lossless: bool,
    sent: u64,
}

impl<M: RosMessage + Send + Sync + 'static> Counted<M> {
    fn new(ros: &RosNode, topic: &str, qos: &Qos, lossless: bool) -> Result<Self, NodeError> {
        let publisher = ros.publisher(topic, qos).map_err(NodeError::runtime)?;
        Ok(Self {
            publisher,
            lossless,
            sent: 0,
        })
    }

    fn wanted(&self) -> bool {
        self.publisher.matched_subscriptions() > 0
    }

    fn send(&mut self, message: &M) {
        let sent: Result<(), PublishError> = if self.lossless {
            self.publisher.publish_lossless(message, PATIENCE)
        } else {
            self.publisher.publish(message)
        };
        match sent {
            Ok(()) => self.sent += 1,
            Err(error) => warn!("{error}"),
        }
    }

    /// Waits for the acknowledgements; what was sent.
    fn settle(&self) -> (String, u64) {
        if let Err(error) = self.publisher.flush(PATIENCE) {
            warn!("{error}");
        }
        (self.publisher.topic().to_owned(), self.sent)
    }
}

/// The node's topics.
struct Topics {
    state: Counted<SystemState>,
    odometry: Vec<Counted<Odometry>>,
    tf: Counted<TFMessage>,
    invariants: Counted<msg::Invariants>,
    scene: Counted<msg::Scene>,
    flown: Counted<ControlSequence>,
}

impl Topics {
    fn new(ros: &RosNode, scene: &Scene, lossless: bool) -> Result<Self, NodeError> {
        let stream = Qos::reliable(STREAM_DEPTH);
        let odometry = scene
            .bodies
            .iter()
            .map(|body| Counted::new(ros, &format!("~/odometry/{}", body.name), &stream, lossless));
        Ok(Self {
            state: Counted::new(ros, "~/state", &stream, lossless)?,
            odometry: odometry.collect::<Result<_, _>>()?,
            tf: Counted::new(ros, "/tf", &stream, lossless)?,
            invariants: Counted::new(ros, "~/invariants", &stream, lossless)?,
            scene: Counted::new(ros, "~/scene", &Qos::latched(1), lossless)?,
            flown: Counted::new(ros, "~/flown_control", &Qos::latched(16), lossless)?,
        })
    }

    /// Whether odometry, tf and invariants have `count` subscribers each.
    fn have_subscribers(&self, count: usize) -> bool {
        self.odometry
            .iter()
            .all(|topic| topic.publisher.matched_subscriptions() >= count)
            && self.tf.publisher.matched_subscriptions() >= count
            && self.invariants.publisher.matched_subscriptions() >= count
    }

    fn settle(&self) -> Published {
        let mut published: Published = self.odometry.iter().map(Counted::settle).collect();
        published.extend([
            self.state.settle(),
            self.tf.settle(),
            self.invariants.settle(),
            self.scene.settle(),
            self.flown.settle(),
        ]);
        published
    }
}

/// A sequence that the loop has yet to answer.
type Pending = (ControlHeader, ControlSequence);

struct Link {
    scene: Arc<Scene>,
    /// For the potential in the invariants.
    simulation: Simulation,
    names: Vec<Name>,
    topics: Topics,
    shm_controls: ControlSubscriber,
    /// One for publishers that keep their last sequence for late joiners, one for those that do not.
    ros_controls: [Subscription<ControlSequence>; 2],
    filled: Consumer<Snapshot>,
    empty: Producer<Snapshot>,
    controls: Producer<Controls>,
    verdicts: Consumer<Result<(), ControlError>>,
    pending: VecDeque<Pending>,
    /// The last sequences that came in, so that what comes by two ways counts once.
    recent: VecDeque<ControlSequence>,
    stop_on_bad_control: bool,
    shared: Arc<Shared>,
    _ros: RosNode,
}

/// Opens the node's topics and starts the second thread.
pub(crate) fn start(
    ros: RosNode,
    shm: &ShmNode,
    config: &Config,
    scene: Arc<Scene>,
    names: Vec<Name>,
    shutdown: &Shutdown,
) -> Result<LinkEnd, NodeError> {
    let topics = Topics::new(&ros, &scene, config.lossless())?;
    let control_topic = ros
        .resolve("~/control_sequence")
        .map_err(NodeError::input)?;
    let (filled_in, filled_out) = RingBuffer::new(SNAPSHOTS);
    let (mut empty_in, empty_out) = RingBuffer::new(SNAPSHOTS);
    let (controls_in, controls_out) = RingBuffer::new(SEQUENCES);
    let (verdicts_in, verdicts_out) = RingBuffer::new(SEQUENCES);
    for _ in 0..SNAPSHOTS {
        let states = scene.bodies.iter().map(|body| body.state).collect();
        let _ = empty_in.push(Snapshot { step: 0, states });
    }
    let shared = Arc::new(Shared::default());
    let mut link = Link {
        simulation: scene.simulation(),
        names,
        topics,
        shm_controls: shm
            .control_subscriber(&control_topic)
            .map_err(NodeError::runtime)?,
        ros_controls: [
            ros.subscription(&control_topic, &Qos::latched(SEQUENCES))
                .map_err(NodeError::runtime)?,
            ros.subscription(&control_topic, &Qos::reliable(SEQUENCES))
                .map_err(NodeError::runtime)?,
        ],
        filled: filled_out,
        empty: empty_in,
        controls: controls_in,
        verdicts: verdicts_out,
        pending: VecDeque::new(),
        recent: VecDeque::new(),
        stop_on_bad_control: config.stop_on_bad_control,
        shared: Arc::clone(&shared),
        scene,
        _ros: ros,
    };
    link.announce_scene()?;
    let await_subscribers = config.await_subscribers;
    let stop = shutdown.clone();
    let (report, published) = mpsc::channel();
    let thread = std::thread::Builder::new()
        .name("ros".into())
        .spawn(move || link.serve(await_subscribers, &report, &stop))
        .map_err(NodeError::runtime)?;
    Ok(LinkEnd {
        filled: filled_in,
        empty: empty_out,
        controls: controls_out,
        verdicts: verdicts_in,
        published,
        shared,
        thread,
        shutdown: shutdown.clone(),
    })
}

impl Link {
    fn announce_scene(&mut self) -> Result<(), NodeError> {
        let scene = &self.scene;
        let message = msg::Scene {
            header: messages::header(scene, 0).map_err(NodeError::input)?,
            name: scene.name.clone(),
            text: scene.text.clone(),
            software: crate::SOFTWARE.into(),
        };
        self.topics.scene.send(&message);
        Ok(())
    }

    /// Serves the loop until it has ended, reports, and stays for late joiners until the shutdown.
    fn serve(
        mut self,
        await_subscribers: usize,
        report: &mpsc::Sender<Published>,
        shutdown: &Shutdown,
    ) {
        let mut sequence = 0;
        let mut reported = false;
        while !(reported && shutdown.requested()) {
            if self.topics.have_subscribers(await_subscribers) {
                self.shared.attended.store(true, Ordering::Release);
            }
            let finish = self.shared.finish.load(Ordering::Acquire);
            self.answer_pending();
            self.receive_controls();
            let mut idle = true;
            while let Ok(snapshot) = self.filled.pop() {
                idle = false;
                self.publish(&snapshot, &mut sequence);
                // As many places as snapshots.
                let _ = self.empty.push(snapshot);
            }
            if finish && !reported {
                self.answer_pending();
                reported = true;
                if report.send(self.topics.settle()).is_err() {
                    return;
                }
            }
            if idle {
                std::thread::sleep(IDLE);
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
            && let Ok(message) = messages::invariants(scene, self.simulation.system(), snapshot)
        {
            if message.energy.is_finite() {
                topics.invariants.send(&message);
            } else {
                let fault = format!("step {}: the energy is not finite", snapshot.step);
                let _ = self.shared.fault.set(fault);
            }
        }
    }

    fn receive_controls(&mut self) {
        match self.shm_controls.receive() {
            Ok(Some(sample)) => {
                let (header, intervals) = (*sample.header(), sample.elements());
                match header.to_message(intervals, &self.scene.frame) {
                    Ok(message) => self.consider(message),
                    Err(error) => self.refuse(error.into()),
                }
            }
            Ok(None) => {}
            Err(error) => warn!("{error}"),
        }
        for subscription in 0..self.ros_controls.len() {
            match self.ros_controls[subscription].take() {
                Ok(Some(sample)) => self.consider(sample.message),
                Ok(None) => {}
                Err(error) => self.refuse(ControlError::Undecodable(error.to_string())),
            }
        }
    }

    /// Checks a sequence that came in and sends it to the loop.
    fn consider(&mut self, message: ControlSequence) {
        if self.recent.contains(&message) {
            return;
        }
        let checked = ControlHeader::from_message(&message)
            .map_err(ControlError::from)
            .and_then(|(header, intervals)| {
                Ok((header, Controls::check(&self.scene, &header, &intervals)?))
            });
        self.recent.truncate(SEQUENCES - 1);
        self.recent.push_front(message.clone());
        match checked {
            Ok((header, controls)) => {
                if self.controls.push(controls).is_ok() {
                    self.pending.push_back((header, message));
                } else {
                    warn!("control sequence refused: {SEQUENCES} others wait to be taken up");
                    self.recent.pop_front();
                }
            }
            Err(error) => self.refuse(error),
        }
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
            let Some((header, message)) = self.pending.pop_front() else {
                return;
            };
            match verdict {
                Ok(()) => {
                    info!(
                        "flying a control sequence for {} from step {}",
                        header.body, header.first_step
                    );
                    self.topics.flown.send(&message);
                }
                Err(error) => warn!("control sequence refused: {error}"),
            }
        }
    }
}
