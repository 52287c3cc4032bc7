use lgvi_middleware::ros::{PublishError, Publisher, Qos, RosNode};
use lgvi_msgs::RosMessage;
use lgvi_msgs::msg::{self, ControlSequence, SystemState};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::tf2_msgs::TFMessage;
use lgvi_msgs::visualization_msgs::MarkerArray;
use lgvi_node::NodeError;
use lgvi_scene::Scene;
use tracing::warn;

use super::Published;
use crate::config::PATIENCE;

/// Depth of the topics that stream.
const STREAM_DEPTH: usize = 1000;

/// A publisher with the number of messages it has sent.
pub(super) struct Counted<M> {
    publisher: Publisher<M>,
    lossless: bool,
    sent: u64,
}

impl<M: RosMessage + Send + Sync + 'static> Counted<M> {
    pub(super) fn new(
        ros: &RosNode,
        topic: &str,
        qos: &Qos,
        lossless: bool,
    ) -> Result<Self, NodeError> {
        let publisher = ros.publisher(topic, qos).map_err(NodeError::runtime)?;
        Ok(Self {
            publisher,
            lossless,
            sent: 0,
        })
    }

    pub(super) fn wanted(&self) -> bool {
        self.publisher.matched_subscriptions() > 0
    }

    pub(super) fn send(&mut self, message: &M) {
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
    pub(super) fn settle(&self) -> (String, u64) {
        if let Err(error) = self.publisher.flush(PATIENCE) {
            warn!("{error}");
        }
        (self.publisher.topic().to_owned(), self.sent)
    }
}

/// The node's topics.
pub(super) struct Topics {
    pub(super) state: Counted<SystemState>,
    pub(super) odometry: Vec<Counted<Odometry>>,
    pub(super) tf: Counted<TFMessage>,
    pub(super) invariants: Counted<msg::Invariants>,
    pub(super) scene: Counted<msg::Scene>,
    /// None where the scene has no frames.
    pub(super) tf_static: Option<Counted<TFMessage>>,
    pub(super) markers: Counted<MarkerArray>,
    pub(super) flown: Counted<ControlSequence>,
}

impl Topics {
    pub(super) fn new(ros: &RosNode, scene: &Scene, lossless: bool) -> Result<Self, NodeError> {
        let stream = Qos::reliable(STREAM_DEPTH);
        let odometry = scene
            .bodies
            .iter()
            .map(|body| Counted::new(ros, &format!("~/odometry/{}", body.name), &stream, lossless));
        let once = Qos::latched(1);
        let tf_static = (!scene.frames.is_empty())
            .then(|| Counted::new(ros, "/tf_static", &once, lossless))
            .transpose()?;
        Ok(Self {
            state: Counted::new(ros, "~/state", &stream, lossless)?,
            odometry: odometry.collect::<Result<_, _>>()?,
            tf: Counted::new(ros, "/tf", &stream, lossless)?,
            invariants: Counted::new(ros, "~/invariants", &stream, lossless)?,
            scene: Counted::new(ros, "~/scene", &once, lossless)?,
            tf_static,
            markers: Counted::new(ros, "~/markers", &once, lossless)?,
            flown: Counted::new(ros, "~/flown_control", &Qos::latched(16), lossless)?,
        })
    }

    /// Whether odometry, tf and invariants have `count` subscribers each.
    pub(super) fn have_subscribers(&self, count: usize) -> bool {
        self.odometry
            .iter()
            .all(|topic| topic.publisher.matched_subscriptions() >= count)
            && self.tf.publisher.matched_subscriptions() >= count
            && self.invariants.publisher.matched_subscriptions() >= count
    }

    pub(super) fn settle(&self) -> Published {
        let mut published: Published = self.odometry.iter().map(Counted::settle).collect();
        published.extend([
            self.state.settle(),
            self.tf.settle(),
            self.invariants.settle(),
            self.scene.settle(),
            self.markers.settle(),
            self.flown.settle(),
        ]);
        published.extend(self.tf_static.iter().map(Counted::settle));
        published
    }
}
