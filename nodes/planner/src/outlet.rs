use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lgvi_middleware::node::{Node, NodeError};
use lgvi_middleware::ros::{PublishError, Publisher, Qos, RawPublisher, RosNode};
use lgvi_middleware::shm::{ControlPublisher, ShmNode};
use lgvi_msgs::msg::{ControlSequence, PlanProgress};
use lgvi_msgs::nav_msgs::Path;
use lgvi_msgs::shm::ControlHeader;
use lgvi_msgs::stamp::StampError;
use lgvi_msgs::visualization_msgs::MarkerArray;
use lgvi_msgs::{RosMessage, cdr};
use lgvi_scene::Scene;
use tracing::warn;

use crate::markers::markers;
use crate::messages;
use crate::sequence::Sequence;

/// How long subscribers that do not keep up are waited for.
pub(crate) const PATIENCE: Duration = Duration::from_secs(5);

/// How often the shutdown is looked for while waiting.
const LOOK: Duration = Duration::from_millis(50);

/// How long somebody to be told of a failure is waited for: discovery takes up to 1.2 s.
const DISCOVERY: Duration = Duration::from_secs(2);

/// Where the node publishes.
///
/// A thread of its own publishes on the network, so that no plan waits for a subscriber that does not keep up.
pub(crate) struct Outlet {
    shm: ControlPublisher,
    topics: Arc<Topics>,
    /// None once the outlet closes.
    parcels: Option<Sender<Parcel>>,
    courier: Option<JoinHandle<()>>,
    /// Control sequences given to the thread.
    sequences: u64,
}

/// The topics on the network.
struct Topics {
    controls: RawPublisher,
    progress: Publisher<PlanProgress>,
    path: Publisher<Path>,
    markers: Publisher<MarkerArray>,
    /// Control sequences that could not be published.
    failed: AtomicU64,
}

/// What the thread is given, in this order.
enum Parcel {
    Controls(Vec<u8>),
    Progress(PlanProgress),
    Path(Path),
    Markers(MarkerArray),
    /// Asks for the acknowledgments, each up to a time, and for the messages sent, by topic.
    Settle(Duration, Sender<BTreeMap<String, u64>>),
}

impl Outlet {
    /// Opens the node's topics; late joiners get the last `history` messages about the progress, and the control sequences of
    /// as many `bodies`.
    pub(crate) fn open(
        ros: &RosNode,
        shm: &ShmNode,
        history: usize,
        bodies: usize,
    ) -> Result<Self, NodeError> {
        let topic = ros.resolve("~/control_sequence")?;
        let shm = shm.control_publisher(&topic)?;
        let latched = Qos::latched(bodies);
        let topics = Arc::new(Topics {
            controls: ros.raw_publisher(&topic, ControlSequence::TYPE_NAME, &latched)?,
            progress: ros.publisher("~/progress", &Qos::latched(history))?,
            path: ros.publisher("~/planned_path", &Qos::latched(1))?,
            markers: ros.publisher("~/markers", &Qos::latched(1))?,
            failed: AtomicU64::new(0),
        });
        let (parcels, given) = channel();
        let theirs = Arc::clone(&topics);
        let courier = std::thread::Builder::new()
            .name("outlet".into())
            .spawn(move || theirs.deliver(&given))
            .map_err(NodeError::runtime)?;
        Ok(Self {
            shm,
            topics,
            parcels: Some(parcels),
            courier: Some(courier),
            sequences: 0,
        })
    }

    /// Publishes an iteration, or how it ended.
    pub(crate) fn progress(&self, message: Result<PlanProgress, StampError>) {
        let message = message.map_err(NodeError::runtime);
        if let Err(error) = message.and_then(|message| self.give(Parcel::Progress(message))) {
            warn!("{error}");
        }
    }

    /// Publishes a plan: the control sequences of all bodies, and the path of the first.
    pub(crate) fn plan(&mut self, scene: &Scene, sequence: &Sequence) -> Result<(), NodeError> {
        for one in sequence.all() {
            self.rest(scene, one, one.first_step)?;
        }
        let path = messages::path(scene, sequence).map_err(NodeError::runtime)?;
        self.give(Parcel::Path(path))?;
        let markers = markers(scene, sequence).map_err(NodeError::runtime)?;
        self.give(Parcel::Markers(markers))
    }

    /// Publishes what is left of a sequence from a step on, to be flown as it would be anyway.
    pub(crate) fn rest(
        &mut self,
        scene: &Scene,
        sequence: &Sequence,
        first_step: u64,
    ) -> Result<(), NodeError> {
        let message = sequence.message(scene, sequence.body, first_step);
        self.controls(&message.map_err(NodeError::runtime)?)
    }

    /// The same bytes go both ways, to this host's propagator first; the identity of the sample tells that they are one.
    fn controls(&mut self, message: &ControlSequence) -> Result<(), NodeError> {
        let cdr = cdr::encode(message).map_err(NodeError::runtime)?;
        self.sequences += 1;
        let header = ControlHeader {
            publisher: self.topics.controls.next_sample().writer.0,
            number: self.sequences - self.topics.failed.load(Ordering::Acquire),
        };
        self.shm.send(header, &cdr)?;
        self.give(Parcel::Controls(cdr))
    }

    fn give(&self, parcel: Parcel) -> Result<(), NodeError> {
        let parcels = self.parcels.as_ref();
        let given = parcels.is_some_and(|parcels| parcels.send(parcel).is_ok());
        given.then_some(()).ok_or_else(ended)
    }

    /// Waits for somebody who hears of the progress, unless somebody does, nobody comes, or the node is to end.
    ///
    /// A failure may be over before others have been discovered; its messages are kept for those who come meanwhile.
    pub(crate) fn await_listener(&self, node: &Node) {
        let start = Instant::now();
        while !node.interrupted()
            && start.elapsed() < DISCOVERY
            && !self.topics.progress.wait_for_subscriptions(1, LOOK)
        {}
    }

    /// Waits until everything is published, and for the acknowledgments, each up to `patience`; the messages sent, by topic.
    pub(crate) fn settle(&self, patience: Duration) -> Result<BTreeMap<String, u64>, NodeError> {
        let (answer, answered) = channel();
        self.give(Parcel::Settle(patience, answer))?;
        answered.recv().map_err(|_| ended())
    }
}

impl Drop for Outlet {
    fn drop(&mut self) {
        drop(self.parcels.take());
        if let Some(courier) = self.courier.take()
            && courier.join().is_err()
        {
            warn!("the outlet's thread has panicked");
        }
    }
}

impl Topics {
    /// Publishes what comes, until nothing can come.
    fn deliver(&self, parcels: &Receiver<Parcel>) {
        let mut sent = BTreeMap::new();
        for parcel in parcels {
            match parcel {
                Parcel::Controls(cdr) => {
                    let published = self.controls.publish_lossless(cdr, PATIENCE);
                    if published.is_err() {
                        self.failed.fetch_add(1, Ordering::Release);
                    }
                    count(published, self.controls.topic(), &mut sent);
                }
                Parcel::Progress(message) => send(&self.progress, &message, &mut sent),
                Parcel::Path(message) => send(&self.path, &message, &mut sent),
                Parcel::Markers(message) => send(&self.markers, &message, &mut sent),
                Parcel::Settle(patience, answer) => {
                    self.flush(patience);
                    // Nobody hears it only where the node has failed meanwhile.
                    let _ = answer.send(sent.clone());
                }
            }
        }
    }

    fn flush(&self, patience: Duration) {
        let flushed = [
            self.controls.flush(patience),
            self.progress.flush(patience),
            self.path.flush(patience),
            self.markers.flush(patience),
        ];
        for error in flushed.into_iter().filter_map(Result::err) {
            warn!("{error}");
        }
    }
}

fn ended() -> NodeError {
    NodeError::runtime("the outlet's thread has ended")
}

fn send<M: RosMessage + Send + Sync + 'static>(
    publisher: &Publisher<M>,
    message: &M,
    sent: &mut BTreeMap<String, u64>,
) {
    let published = publisher.publish_lossless(message, PATIENCE);
    count(published, publisher.topic(), sent);
}

fn count(published: Result<(), PublishError>, topic: &str, sent: &mut BTreeMap<String, u64>) {
    match published {
        Ok(()) => *sent.entry(topic.to_owned()).or_default() += 1,
        Err(error) => warn!("{error}"),
    }
}
