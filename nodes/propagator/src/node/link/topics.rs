use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use lgvi_middleware::node::{Node, NodeError};
use lgvi_middleware::ros::{Qos, RosNode};
use lgvi_msgs::RosMessage;
use lgvi_msgs::geometry_msgs::InertiaStamped;
use lgvi_msgs::msg::{self, ControlSequence, Intervention, SystemState};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::sensor_msgs::JointState;
use lgvi_msgs::tf2_msgs::TFMessage;
use lgvi_msgs::visualization_msgs::MarkerArray;
use lgvi_scene::{NamedBody, Scene};
use rtrb::Consumer;

use super::clock::FlightClock;
use super::counted::{Counted, Counts};
use super::sensors::SensorTopics;
use super::settling::Outgoing;
use crate::node::sensors::Reading;

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
    /// The thrusters of the bodies that have some.
    pub(super) thrusters: Vec<(usize, Counted<JointState>)>,
    /// Mass and inertia of the bodies with propellant.
    pub(super) inertias: Vec<(usize, Counted<InertiaStamped>)>,
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

/// Makes topics that only some bodies have.
struct OfBodies<'a> {
    ros: &'a RosNode,
    scene: &'a Scene,
    lossless: &'a Arc<AtomicBool>,
}

impl OfBodies<'_> {
    fn topics<M: RosMessage + Send + Sync + 'static>(
        &self,
        name: &str,
        has: impl Fn(&NamedBody) -> bool,
    ) -> Result<Vec<(usize, Counted<M>)>, NodeError> {
        let qos = Qos::reliable(STREAM_DEPTH);
        let bodies = self.scene.bodies.iter().enumerate();
        let topics = bodies.filter(|(_, body)| has(body)).map(|(index, body)| {
            let topic = format!("~/{name}/{}", body.name);
            Ok((index, Counted::new(self.ros, &topic, &qos, self.lossless)?))
        });
        topics.collect()
    }
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
        let of_bodies = OfBodies {
            ros,
            scene,
            lossless,
        };
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
            joints: of_bodies.topics("joint_states", |body| !body.wheels.is_empty())?,
            thrusters: of_bodies.topics("thruster_states", |body| !body.thrusters.is_empty())?,
            inertias: of_bodies.topics("inertia", NamedBody::has_propellant)?,
            tf: Counted::new(ros, "/tf", &stream, lossless)?,
            invariants: Counted::new(ros, "~/invariants", &stream, lossless)?,
        })
    }

    /// Whether anybody has subscribed to what is made of states.
    pub(super) fn wanted(&self) -> bool {
        // All are asked, for the counts.
        let odometry = self.odometry.iter().filter(|topic| topic.wanted()).count();
        let joints = self.joints.iter().chain(&self.thrusters);
        let joints = joints.filter(|(_, topic)| topic.wanted()).count();
        let inertias = self.inertias.iter();
        let inertias = inertias.filter(|(_, topic)| topic.wanted()).count();
        let others = [
            self.state.wanted(),
            self.tf.wanted(),
            self.invariants.wanted(),
        ];
        odometry + joints + inertias > 0 || others.contains(&true)
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
        let joints = self.joints.iter().chain(&self.thrusters);
        outgoing.extend(joints.map(|(_, topic)| topic as &dyn Outgoing));
        outgoing.extend(
            self.inertias
                .iter()
                .map(|(_, topic)| topic as &dyn Outgoing),
        );
        outgoing.extend(self.sensors.outgoing());
        outgoing.extend(self.tf_static.iter().map(|topic| topic as &dyn Outgoing));
        outgoing
    }

    /// What becomes of the messages, by topic.
    pub(super) fn counts(&self) -> Vec<Arc<Counts>> {
        let mut counts = vec![self.state.counts()];
        counts.extend(self.odometry.iter().map(Counted::counts));
        let joints = self.joints.iter().chain(&self.thrusters);
        counts.extend(joints.map(|(_, topic)| topic.counts()));
        counts.extend(self.inertias.iter().map(|(_, topic)| topic.counts()));
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
