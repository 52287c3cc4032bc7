use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use lgvi_control::extremal::Extremal;
use lgvi_middleware::Shutdown;
use lgvi_middleware::log::Rosout;
use lgvi_middleware::ros::{Publisher, Qos, RosNode};
use lgvi_middleware::shm::ControlPublisher;
use lgvi_msgs::RosMessage;
use lgvi_msgs::msg::{ControlSequence, PlanProgress};
use lgvi_msgs::nav_msgs::Path;
use lgvi_msgs::stamp::StampError;
use lgvi_node::{Node, NodeError};
use lgvi_scene::{Maneuver, Scene};
use tracing::warn;

use crate::messages;

/// How long subscribers that do not keep up are waited for.
const PATIENCE: Duration = Duration::from_secs(5);

/// How often the shutdown is looked for while waiting.
const LOOK: Duration = Duration::from_millis(50);

/// How long somebody to be told of a failure is waited for: discovery takes up to 1.2 s.
const DISCOVERY: Duration = Duration::from_secs(2);

/// Where the node publishes.
pub(crate) struct Outlet {
    shm: ControlPublisher,
    controls: Publisher<ControlSequence>,
    progress: Publisher<PlanProgress>,
    path: Publisher<Path>,
    /// Messages sent, by topic.
    sent: BTreeMap<String, u64>,
    _rosout: Rosout,
    _ros: RosNode,
}

impl Outlet {
    /// Opens the node's topics; late joiners get all of up to `iterations` iterations.
    pub(crate) fn open(node: &Node, iterations: u32) -> Result<Self, NodeError> {
        let topic = node
            .args
            .resolve("~/control_sequence")
            .map_err(NodeError::input)?;
        let (ros, rosout) = node.ros()?;
        let every_iteration = Qos::latched(iterations as usize + 2);
        Ok(Self {
            shm: node
                .shm()?
                .control_publisher(&topic)
                .map_err(NodeError::runtime)?,
            controls: ros
                .publisher(&topic, &Qos::latched(1))
                .map_err(NodeError::runtime)?,
            progress: ros
                .publisher("~/progress", &every_iteration)
                .map_err(NodeError::runtime)?,
            path: ros
                .publisher("~/planned_path", &Qos::latched(1))
                .map_err(NodeError::runtime)?,
            sent: BTreeMap::new(),
            _rosout: rosout,
            _ros: ros,
        })
    }

    /// Publishes an iteration.
    pub(crate) fn progress(&mut self, message: Result<PlanProgress, StampError>) {
        match message {
            Ok(message) => send(&self.progress, &message, &mut self.sent),
            Err(error) => warn!("{error}"),
        }
    }

    /// Publishes the plan.
    pub(crate) fn plan(
        &mut self,
        scene: &Scene,
        maneuver: &Maneuver,
        plan: &Extremal,
    ) -> Result<(), NodeError> {
        let (header, intervals) =
            messages::controls(scene, maneuver, plan).map_err(NodeError::runtime)?;
        let message = header
            .to_message(&intervals, &scene.frame)
            .map_err(NodeError::runtime)?;
        send(&self.controls, &message, &mut self.sent);
        self.shm
            .send(header, &intervals)
            .map_err(NodeError::runtime)?;
        let path = messages::path(scene, plan).map_err(NodeError::runtime)?;
        send(&self.path, &path, &mut self.sent);
        Ok(())
    }

    /// Waits for somebody who hears of the progress, unless somebody does, nobody comes, or the node is to end.
    ///
    /// A failure may be over before others have been discovered; its messages are kept for those who come meanwhile.
    pub(crate) fn await_listener(&self, shutdown: &Shutdown) {
        let start = Instant::now();
        while !shutdown.requested()
            && start.elapsed() < DISCOVERY
            && !self.progress.wait_for_subscriptions(1, LOOK)
        {}
    }

    /// Waits for the acknowledgements; the messages sent, by topic.
    pub(crate) fn settle(&self) -> BTreeMap<String, u64> {
        let settled = [
            self.controls.flush(PATIENCE),
            self.progress.flush(PATIENCE),
            self.path.flush(PATIENCE),
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
    match publisher.publish_lossless(message, PATIENCE) {
        Ok(()) => *sent.entry(publisher.topic().to_owned()).or_default() += 1,
        Err(error) => warn!("{error}"),
    }
}
