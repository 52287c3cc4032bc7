use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use lgvi_middleware::node::{Node, NodeError};
use lgvi_middleware::ros::Qos;
use lgvi_msgs::msg::{self, ControlSequence, Intervention, SystemState};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::sensor_msgs::JointState;
use lgvi_msgs::tf2_msgs::TFMessage;
use lgvi_msgs::visualization_msgs::MarkerArray;
use lgvi_scene::Scene;
use rtrb::Consumer;

use super::clock::FlightClock;
use super::counted::{Counted, Counts};
use super::sensors::SensorTopics;
use super::settling::Outgoing;
use crate::sensors::Reading;

/// Depth of the topics that stream.
pub(super) const STREAM_DEPTH: usize = 1000;

/// Depth of what is flown: a controller may send fifty wrenches a second.
const FLOWN_DEPTH: usize = 128;

/// The node's topics.
pub(super) struct Topics {
    pub(super) state: Counted<SystemState>,
    pub(super) odometry: Vec<Counted<Odometry>>,
    /// The wheels of the bodies that have some.
    pub(super) joints: Vec<(usize, Counted<JointState>)>,
    pub(super) tf: Counted<TFMessage>,
    pub(super) invariants: Counted<msg::Invariants>,
    pub(super) scene: Counted<msg::Scene>,
    /// None where the scene has no frames.
    pub(super) tf_static: Option<Counted<TFMessage>>,
    pub(super) markers: Counted<MarkerArray>,
    pub(super) flown: Counted<ControlSequence>,
    pub(super) intervention: Counted<Intervention>,
    pub(super) clock: Option<FlightClock>,
    pub(super) sensors: SensorTopics,
}

impl Topics {
    pub(super) fn new(
        node: &Node,
        scene: &Scene,
        clock: bool,
        lossless: &Arc<AtomicBool>,
        readings: Consumer<Reading>,
    ) -> Result<Self, NodeError> {
        let ros = &node.ros;
        let stream = Qos::reliable(STREAM_DEPTH);
        // Of a thousand bodies these take seconds.
        let odometry = scene.bodies.iter().map(|body| {
            if node.shutdown.requested() {
                return Err(NodeError::Interrupted);
            }
            Counted::new(ros, &format!("~/odometry/{}", body.name), &stream, lossless)
        });
        let wheeled = scene.bodies.iter().enumerate();
        let joints = wheeled
            .filter(|(_, body)| !body.wheels.is_empty())
            .map(|(index, body)| {
                let topic = format!("~/joint_states/{}", body.name);
                Ok::<_, NodeError>((index, Counted::new(ros, &topic, &stream, lossless)?))
            });
        let once = Qos::latched(1);
        let tf_static = (!scene.frames.is_empty())
            .then(|| Counted::new(ros, "/tf_static", &once, lossless))
            .transpose()?;
        Ok(Self {
            // Announced in this order. Who knows those whose subscribers may be awaited knows those before them, too.
            scene: Counted::new(ros, "~/scene", &once, lossless)?,
            tf_static,
            markers: Counted::new(ros, "~/markers", &once, lossless)?,
            flown: Counted::new(ros, "~/flown_control", &Qos::latched(FLOWN_DEPTH), lossless)?,
            intervention: Counted::new(ros, "~/intervention", &Qos::latched(16), lossless)?,
            clock: clock.then(|| FlightClock::new(ros)).transpose()?,
            sensors: SensorTopics::new(ros, scene, lossless, readings)?,
            state: Counted::new(ros, "~/state", &stream, lossless)?,
            odometry: odometry.collect::<Result<_, _>>()?,
            joints: joints.collect::<Result<_, _>>()?,
            tf: Counted::new(ros, "/tf", &stream, lossless)?,
            invariants: Counted::new(ros, "~/invariants", &stream, lossless)?,
        })
    }

    /// Whether anybody has subscribed to what is made of states.
    pub(super) fn wanted(&self) -> bool {
        // All are asked, for the counts.
        let odometry = self.odometry.iter().filter(|topic| topic.wanted()).count();
        let joints = self
            .joints
            .iter()
            .filter(|(_, topic)| topic.wanted())
            .count();
        let others = [
            self.state.wanted(),
            self.tf.wanted(),
            self.invariants.wanted(),
        ];
        odometry + joints > 0 || others.contains(&true)
    }

    /// Whether odometry, tf and invariants have `count` subscribers each.
    pub(super) fn have_subscribers(&self, count: usize) -> bool {
        self.odometry
            .iter()
            .all(|topic| topic.subscribers() >= count)
            && self.tf.subscribers() >= count
            && self.invariants.subscribers() >= count
    }

    /// Those whose messages are waited for at the end.
    pub(super) fn outgoing(&self) -> Vec<&dyn Outgoing> {
        let mut outgoing: Vec<&dyn Outgoing> = vec![
            &self.state,
            &self.tf,
            &self.invariants,
            &self.scene,
            &self.markers,
            &self.flown,
            &self.intervention,
        ];
        outgoing.extend(self.odometry.iter().map(|topic| topic as &dyn Outgoing));
        outgoing.extend(self.joints.iter().map(|(_, topic)| topic as &dyn Outgoing));
        outgoing.extend(self.sensors.outgoing());
        outgoing.extend(self.tf_static.iter().map(|topic| topic as &dyn Outgoing));
        outgoing
    }

    /// What becomes of the messages, by topic.
    pub(super) fn counts(&self) -> Vec<Arc<Counts>> {
        let mut counts = vec![self.state.counts()];
        counts.extend(self.odometry.iter().map(Counted::counts));
        counts.extend(self.joints.iter().map(|(_, topic)| topic.counts()));
        counts.extend([
            self.tf.counts(),
            self.invariants.counts(),
            self.scene.counts(),
            self.markers.counts(),
            self.flown.counts(),
            self.intervention.counts(),
        ]);
        counts.extend(self.sensors.counts());
        counts.extend(self.tf_static.as_ref().map(Counted::counts));
        counts.extend(self.clock.as_ref().map(FlightClock::counts));
        counts
    }
}
