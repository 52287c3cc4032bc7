//! ROS 2 topics over DDS: this project's, and the same by ros2-client alone.

use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;
use std::time::Duration;

use lgvi_middleware::ros::{self, RosNode};
use lgvi_middleware::{Environment, NodeArgs};
use lgvi_msgs::msg::{BodyState, SystemState};
use ros2_client::{Context, MessageTypeName, Name, Node, NodeName, NodeOptions, QosProfile};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{DomainParticipantBuilder, QosPolicyBuilder, Topic};
use serde::{Serialize, Serializer};
use tokio::runtime::{Builder, Runtime};

use super::way::{Receiver, Sender, Stamp, TOPIC};
use super::{Place, failed};
use crate::error::BenchError;

/// Names of the nodes that send and receive.
const NEAR: &str = "lgvi_bench";
const FAR: &str = "lgvi_bench_far";

/// Samples that wait.
const DEPTH: i32 = 1000;

/// This project's end that sends.
pub(super) struct OwnSender {
    port: ros::Publisher<SystemState>,
    message: SystemState,
    _node: RosNode,
}

/// This project's end that receives.
pub(super) struct OwnReceiver {
    port: ros::Subscription<SystemState>,
    _node: RosNode,
}

/// ros2-client's end that sends.
pub(super) struct BareSender {
    port: ros2_client::Publisher<Shared>,
    message: Arc<SystemState>,
    _node: Node,
}

/// ros2-client's end that receives.
pub(super) struct BareReceiver {
    port: ros2_client::Subscription<SystemState>,
    runtime: Runtime,
    _node: Node,
}

/// A message that is sent without being copied before.
struct Shared(Arc<SystemState>);

impl Serialize for Shared {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

fn message(bodies: usize) -> SystemState {
    let body = |index| BodyState {
        name: format!("body{index}"),
        ..BodyState::default()
    };
    SystemState {
        bodies: (0..bodies).map(body).collect(),
        ..SystemState::default()
    }
}

fn stamp(message: &SystemState) -> Stamp {
    Stamp {
        sequence: message.sequence,
        nanoseconds: message.step,
    }
}

fn node(place: &Place, name: &str) -> Result<RosNode, BenchError> {
    let (args, _) = NodeArgs::parse(name, []).map_err(failed)?;
    RosNode::new(&args, &Environment::localhost(place.domain)).map_err(failed)
}

/// The same by ros2-client, with the topic.
fn bare(place: &Place, name: &str) -> Result<(Node, Topic), BenchError> {
    let participant = DomainParticipantBuilder::new(place.domain)
        .with_only_networks([IpAddr::V4(Ipv4Addr::LOCALHOST)])
        .build()
        .map_err(debug)?;
    let context = Context::from_domain_participant(participant).map_err(debug)?;
    let name = NodeName::new("/", name).map_err(debug)?;
    let node = context.new_node(name, NodeOptions::new().enable_rosout(false));
    let node = node.map_err(debug)?;
    let topic = node
        .create_topic(
            &Name::parse(TOPIC).map_err(debug)?,
            MessageTypeName::new("lgvi_msgs", "SystemState"),
            &qos(Durability::Volatile),
        )
        .map_err(debug)?;
    Ok((node, topic))
}

/// As this project's streams of states.
fn qos(durability: Durability) -> QosProfile {
    let policies = QosPolicyBuilder::new()
        .reliability(Reliability::Reliable {
            max_blocking_time: rustdds::Duration::from_millis(100),
        })
        .durability(durability)
        .history(History::KeepLast { depth: DEPTH })
        .build();
    QosProfile::from(&policies)
}

fn debug(error: impl std::fmt::Debug) -> BenchError {
    failed(format!("{error:?}"))
}

impl OwnSender {
    pub(super) fn new(place: &Place, bodies: usize) -> Result<Self, BenchError> {
        let node = node(place, NEAR)?;
        let qos = ros::Qos::reliable(DEPTH as usize);
        Ok(Self {
            port: node.publisher(TOPIC, &qos).map_err(failed)?,
            message: message(bodies),
            _node: node,
        })
    }
}

impl Sender for OwnSender {
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

impl OwnReceiver {
    pub(super) fn new(place: &Place) -> Result<Self, BenchError> {
        let node = node(place, FAR)?;
        let qos = ros::Qos::reliable(DEPTH as usize);
        Ok(Self {
            port: node.subscription(TOPIC, &qos).map_err(failed)?,
            _node: node,
        })
    }
}

impl Receiver for OwnReceiver {
    fn receive(&mut self, patience: Duration) -> Result<Option<Stamp>, BenchError> {
        let sample = self.port.recv_timeout(patience).map_err(failed)?;
        Ok(sample.map(|sample| stamp(&sample.message)))
    }
}

impl BareSender {
    pub(super) fn new(place: &Place, bodies: usize) -> Result<Self, BenchError> {
        let (mut node, topic) = bare(place, NEAR)?;
        let qos = qos(Durability::TransientLocal);
        Ok(Self {
            port: node.create_publisher(&topic, Some(qos)).map_err(debug)?,
            message: Arc::new(message(bodies)),
            _node: node,
        })
    }
}

impl Sender for BareSender {
    fn send(&mut self, stamp: Stamp) -> Result<(), BenchError> {
        let message = Arc::make_mut(&mut self.message);
        message.sequence = stamp.sequence;
        message.step = stamp.nanoseconds;
        // what finds no room the receiver counts
        let _ = self.port.publish(Shared(Arc::clone(&self.message)));
        Ok(())
    }
}

impl BareReceiver {
    pub(super) fn new(place: &Place) -> Result<Self, BenchError> {
        let (mut node, topic) = bare(place, FAR)?;
        let qos = qos(Durability::Volatile);
        let runtime = Builder::new_current_thread().enable_time().build();
        Ok(Self {
            port: node.create_subscription(&topic, Some(qos)).map_err(debug)?,
            runtime: runtime.map_err(failed)?,
            _node: node,
        })
    }
}

impl Receiver for BareReceiver {
    fn receive(&mut self, patience: Duration) -> Result<Option<Stamp>, BenchError> {
        let port = &self.port;
        let sample = self.runtime.block_on(async {
            let sample = tokio::time::timeout(patience, port.async_take());
            sample.await.ok().transpose()
        });
        let sample = sample.map_err(debug)?;
        Ok(sample.map(|(message, _)| stamp(&message)))
    }
}
