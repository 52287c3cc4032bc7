//! Control sequences of strangers.

use lgvi_middleware::ros::{Publisher, Qos, RosNode};
use lgvi_msgs::geometry_msgs::Vector3;
use lgvi_msgs::msg::ControlSequence;

use crate::flight::INCLINATION_CHANGE_STEP;

/// A sequence for `scenes/inclination_change.toml` that does nothing.
pub fn coast() -> ControlSequence {
    const STEPS: usize = 1000;
    let mut sequence = ControlSequence {
        body: "spacecraft".into(),
        step_size: INCLINATION_CHANGE_STEP,
        force: vec![Vector3::default(); STEPS],
        moment: vec![Vector3::default(); STEPS],
        ..ControlSequence::default()
    };
    sequence.header.frame_id = "inertial".into();
    sequence
}

/// Publishes a sequence to the propagator, also if it comes later; keep the publisher.
pub fn publish(node: &RosNode, sequence: &ControlSequence) -> Publisher<ControlSequence> {
    let topic = "/lgvi_propagator/control_sequence";
    let publisher = node
        .publisher(topic, &Qos::latched(1))
        .expect("a publisher");
    publisher.publish(sequence).expect("a sequence");
    publisher
}
