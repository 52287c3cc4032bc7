//! The wire of DDS: RustDDS, with the graph messages of ros2-client.
//!
//! A node is one DDS participant. Its endpoints are made on RustDDS directly and announced in the ROS graph
//! (`ros_discovery_info`) by the node itself; `docs/decisions/rustdds.md` says why, and what here works round RustDDS.

mod admission;
mod background;
mod cdr;
mod census;
mod descriptors;
mod farewell;
mod faults;
mod fence;
mod first_samples;
mod graph;
mod inbox;
mod keeps;
mod laggards;
mod local;
mod matches;
mod names;
mod naming;
mod participant;
mod peers;
mod policies;
mod publisher;
mod rtps;
mod security;
mod service;
mod sockets;
mod subscription;

use std::sync::Arc;

use participant::Participant;
use publisher::Writer;
use service::{Client, Server};
use subscription::Reader;

use super::{
    Namesake, Qos, RosError, TopicInfo,
    wire::{ServiceTypes, Wire, WireClient, WirePublisher, WireServer, WireSubscription},
};
use crate::{Environment, NodeArgs, ServiceMapping, Shutdown};

/// A node in a DDS domain.
pub(super) struct Dds(Arc<Participant>);

impl Dds {
    /// Joins the domain and announces the node. Discovery of others takes 0.1 s to 1.2 s from here.
    pub(super) fn new(
        args: &NodeArgs,
        environment: &Environment,
        mapping: ServiceMapping,
    ) -> Result<Self, RosError> {
        let enclave = security::enclave(args, environment)?;
        Participant::new(args, environment, mapping, enclave.as_ref())
            .map(|participant| Self(Arc::new(participant)))
            .map_err(|reason| RosError::Join {
                domain_id: environment.domain_id,
                reason,
            })
    }

    fn reader(&self, topic: &str, type_name: &str, qos: &Qos) -> Result<Reader, RosError> {
        Reader::new(&self.0, topic, naming::dds_topic(topic), type_name, qos)
    }
}

impl Wire for Dds {
    fn publisher(
        &self,
        topic: String,
        type_name: &str,
        qos: &Qos,
    ) -> Result<Box<dyn WirePublisher>, RosError> {
        let dds_topic = naming::dds_topic(&topic);
        Ok(Box::new(Writer::new(
            &self.0, &topic, dds_topic, type_name, qos,
        )?))
    }

    fn subscription(
        &self,
        topic: String,
        type_name: &str,
        qos: &Qos,
    ) -> Result<Box<dyn WireSubscription>, RosError> {
        Ok(Box::new(self.reader(&topic, type_name, qos)?))
    }

    fn server(&self, service: &str, types: ServiceTypes) -> Result<Box<dyn WireServer>, RosError> {
        Ok(Box::new(Server::new(&self.0, service, types)?))
    }

    fn client(&self, service: &str, types: ServiceTypes) -> Result<Box<dyn WireClient>, RosError> {
        Ok(Box::new(Client::new(&self.0, service, types)?))
    }

    fn topics(&self) -> Vec<TopicInfo> {
        self.0.topics()
    }

    fn other_nodes(&self) -> Vec<String> {
        self.0.names.all()
    }

    fn namesakes(&self) -> Vec<Namesake> {
        self.0.namesakes()
    }

    fn hold_announcements(&self, held: bool) {
        self.0.graph().hold(held);
    }

    fn leave_on(&self, shutdown: &Shutdown) {
        self.0.farewell.on(shutdown);
    }
}
