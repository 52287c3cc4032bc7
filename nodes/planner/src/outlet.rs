use std::collections::BTreeMap;
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
pub(crate) struct Outlet {
    shm: ControlPublisher,
    controls: RawPublisher,
    progress: Publisher<PlanProgress>,
    path: Publisher<Path>,
    markers: Publisher<MarkerArray>,
    /// Messages sent, by topic.
    sent: BTreeMap<String, u64>,
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
        Ok(Self {
            shm: shm.control_publisher(&topic)?,
            controls: ros.raw_publisher(
                &topic,
                ControlSequence::TYPE_NAME,
                &Qos::latched(bodies),
            )?,
            progress: ros.publisher("~/progress", &Qos::latched(history))?,
            path: ros.publisher("~/planned_path", &Qos::latched(1))?,
            markers: ros.publisher("~/markers", &Qos::latched(1))?,
            sent: BTreeMap::new(),
        })
    }

    /// Publishes an iteration, or how it ended.
    pub(crate) fn progress(&mut self, message: Result<PlanProgress, StampError>) {
        match message {
            Ok(message) => send(&self.progress, &message, &mut self.sent),
            Err(error) => warn!("{error}"),
        }
    }

    /// Publishes a plan: the control sequences of all bodies, and the path of the first.
    pub(crate) fn plan(&mut self, scene: &Scene, sequence: &Sequence) -> Result<(), NodeError> {
        for one in sequence.all() {
            self.rest(scene, one.body, one, one.first_step)?;
        }
        let path = messages::path(scene, sequence).map_err(NodeError::runtime)?;
        send(&self.path, &path, &mut self.sent);
        let markers = markers(scene, sequence).map_err(NodeError::runtime)?;
        send(&self.markers, &markers, &mut self.sent);
        Ok(())
    }

    /// Publishes what is left of a sequence from a step on, to be flown as it would be anyway.
    pub(crate) fn rest(
        &mut self,
        scene: &Scene,
        body: usize,
        sequence: &Sequence,
        first_step: u64,
    ) -> Result<(), NodeError> {
        let message = sequence.message(scene, body, first_step);
        self.controls(&message.map_err(NodeError::runtime)?)
    }

    /// The same bytes go both ways, to this host's propagator first; the identity of the sample tells that they are one.
    fn controls(&mut self, message: &ControlSequence) -> Result<(), NodeError> {
        let cdr = cdr::encode(message).map_err(NodeError::runtime)?;
        let sample = self.controls.next_sample();
        let header = ControlHeader {
            publisher: sample.writer.0,
            number: sample.sequence.unsigned_abs(),
        };
        self.shm.send(header, &cdr)?;
        let published = self.controls.publish_lossless(cdr, PATIENCE);
        count(published, self.controls.topic(), &mut self.sent);
        Ok(())
    }

    /// Waits for somebody who hears of the progress, unless somebody does, nobody comes, or the node is to end.
    ///
    /// A failure may be over before others have been discovered; its messages are kept for those who come meanwhile.
    pub(crate) fn await_listener(&self, node: &Node) {
        let start = Instant::now();
        while !node.interrupted()
            && start.elapsed() < DISCOVERY
            && !self.progress.wait_for_subscriptions(1, LOOK)
        {}
    }

    /// Waits for the acknowledgments, each up to `patience`; the messages sent, by topic.
    pub(crate) fn settle(&self, patience: Duration) -> BTreeMap<String, u64> {
        let settled = [
            self.controls.flush(patience),
            self.progress.flush(patience),
            self.path.flush(patience),
            self.markers.flush(patience),
        ];
        for error in settled.into_iter().filter_map(Result::err) {
            warn!("{error}");
        }
        self.sent.clone()
    }
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
