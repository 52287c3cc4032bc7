//! This project's ROS 2 topics, over any wire.

use std::time::Duration;

use lgvi_middleware::ros::{self, RosNode};
use lgvi_middleware::{Environment, NodeArgs};
use lgvi_msgs::msg::{BodyState, SystemState};

use super::failed;
use super::way::{Receiver, Sender, Stamp, TOPIC};
use crate::error::BenchError;

/// Names of the nodes that send and receive.
pub(super) const NEAR: &str = "lgvi_bench";
pub(super) const FAR: &str = "lgvi_bench_far";

/// Samples that wait.
pub(super) const DEPTH: usize = 1000;

/// The end that sends.
pub(super) struct RosSender {
    port: ros::Publisher<SystemState>,
    message: SystemState,
    _node: RosNode,
}

/// The end that receives.
pub(super) struct RosReceiver {
    port: ros::Subscription<SystemState>,
    _node: RosNode,
}

pub(super) fn message(bodies: usize) -> SystemState {
    let body = |index| BodyState {
        name: format!("body{index}"),
        ..BodyState::default()
    };
    SystemState {
        bodies: (0..bodies).map(body).collect(),
        ..SystemState::default()
    }
}

pub(super) fn stamp(message: &SystemState) -> Stamp {
    Stamp {
        sequence: message.sequence,
        nanoseconds: message.step,
    }
}

fn node(environment: &Environment, name: &str) -> Result<RosNode, BenchError> {
    let (args, _) = NodeArgs::parse(name, []).map_err(failed)?;
    RosNode::new(&args, environment).map_err(failed)
}

impl RosSender {
    pub(super) fn new(environment: &Environment, bodies: usize) -> Result<Self, BenchError> {
        let node = node(environment, NEAR)?;
        let qos = ros::Qos::reliable(DEPTH);
        Ok(Self {
            port: node.publisher(TOPIC, &qos).map_err(failed)?,
            message: message(bodies),
            _node: node,
        })
    }
}

impl Sender for RosSender {
    fn send(&mut self, stamp: Stamp) -> Result<(), BenchError> {
        self.message.sequence = stamp.sequence;
        self.message.step = stamp.nanoseconds;
        match self.port.publish(&self.message) {
            // which the receiver counts
            Err(ros::PublishError::Full { .. }) => Ok(()),
            published => published.map_err(failed),
        }
    }
}

impl RosReceiver {
    pub(super) fn new(environment: &Environment) -> Result<Self, BenchError> {
        let node = node(environment, FAR)?;
        let qos = ros::Qos::reliable(DEPTH);
        Ok(Self {
            port: node.subscription(TOPIC, &qos).map_err(failed)?,
            _node: node,
        })
    }
}

impl Receiver for RosReceiver {
    fn receive(&mut self, patience: Duration) -> Result<Option<Stamp>, BenchError> {
        let sample = self.port.recv_timeout(patience).map_err(failed)?;
        Ok(sample.map(|sample| stamp(&sample.message)))
    }
}
