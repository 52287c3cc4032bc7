//! ROS 2 topics over DDS by ros2-client alone.

use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;
use std::time::Duration;

use lgvi_msgs::msg::SystemState;
use ros2_client::{Context, MessageTypeName, Name, Node, NodeName, NodeOptions, QosProfile};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{DomainParticipantBuilder, QosPolicyBuilder, Topic};
use serde::{Serialize, Serializer};
use tokio::runtime::{Builder, Runtime};

use super::ros::{DEPTH, FAR, NEAR, message, stamp};
use super::way::{Receiver, Sender, Stamp, TOPIC};
use super::{Place, failed};
use crate::error::BenchError;

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

/// A node with the topic.
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
        .history(History::KeepLast {
            depth: DEPTH as i32,
        })
        .build();
    QosProfile::from(&policies)
}

fn debug(error: impl std::fmt::Debug) -> BenchError {
    failed(format!("{error:?}"))
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
