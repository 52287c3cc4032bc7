//! Shared memory: this project's channels, and the same by iceoryx2 alone.

use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{
    BackpressureStrategy, FileName, Path, SemanticString, SignalHandlingMode, ipc_threadsafe,
};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use lgvi_middleware::shm::{Delivery, ShmNode, ShmOptions, StatePublisher, StateSubscriber};
use lgvi_msgs::shm::{BodySample, StateHeader};

use super::way::{Receiver, Sender, Stamp, TOPIC, look};
use super::{Place, failed};
use crate::error::BenchError;

/// Samples that wait for a receiver, and bodies of the largest of them.
const BUFFER: usize = 2048;

type Service = ipc_threadsafe::Service;
type Open = PortFactory<Service, [BodySample], StateHeader>;

/// This project's end that sends.
pub(super) struct OwnSender {
    port: StatePublisher,
    bodies: Vec<BodySample>,
}

/// This project's end that receives.
pub(super) struct OwnReceiver {
    port: StateSubscriber,
    spin: bool,
}

/// iceoryx2's end that sends.
pub(super) struct BareSender {
    port: Publisher<Service, [BodySample], StateHeader>,
    bodies: Vec<BodySample>,
    opened: (Node<Service>, Open),
}

/// iceoryx2's end that receives.
pub(super) struct BareReceiver {
    port: Subscriber<Service, [BodySample], StateHeader>,
    spin: bool,
    opened: (Node<Service>, Open),
}

fn node(place: &Place) -> Result<ShmNode, BenchError> {
    let options = ShmOptions {
        domain_id: place.domain,
        root: Some(place.root.join("own")),
    };
    ShmNode::new("/lgvi_bench", &options).map_err(failed)
}

/// The service with the properties that this project gives it.
fn open(place: &Place) -> Result<(Node<Service>, Open), BenchError> {
    let mut config = Config::global_config().clone();
    let root = place.root.join("bare");
    let root = Path::new(root.as_os_str().as_encoded_bytes());
    config.global.set_root_path(&root.map_err(debug)?);
    let prefix = format!("bare_{}_", place.domain);
    config.global.prefix = FileName::new(prefix.as_bytes()).map_err(debug)?;
    let node = NodeBuilder::new()
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<Service>()
        .map_err(failed)?;
    let open = node
        .service_builder(&"bare/state".try_into().map_err(debug)?)
        .publish_subscribe::<[BodySample]>()
        .user_header::<StateHeader>()
        .enable_safe_overflow(false)
        .subscriber_max_buffer_size(BUFFER)
        .max_publishers(1)
        .max_subscribers(1)
        .open_or_create()
        .map_err(debug)?;
    Ok((node, open))
}

pub(super) fn debug(error: impl std::fmt::Debug) -> BenchError {
    failed(format!("{error:?}"))
}

fn header(stamp: Stamp) -> StateHeader {
    StateHeader {
        sequence: stamp.sequence,
        step: stamp.nanoseconds,
        ..StateHeader::default()
    }
}

fn stamp(header: &StateHeader) -> Stamp {
    Stamp {
        sequence: header.sequence,
        nanoseconds: header.step,
    }
}

impl OwnSender {
    pub(super) fn new(place: &Place, bodies: usize) -> Result<Self, BenchError> {
        let delivery = Delivery::DropNewest;
        let port = node(place)?.state_publisher(TOPIC, bodies, delivery);
        Ok(Self {
            port: port.map_err(failed)?,
            bodies: vec![BodySample::default(); bodies],
        })
    }
}

impl Sender for OwnSender {
    fn send(&mut self, stamp: Stamp) -> Result<(), BenchError> {
        let (port, bodies) = (&mut self.port, &self.bodies);
        let sent = port.send(header(stamp), bodies);
        sent.map(drop).map_err(failed)
    }
}

impl OwnReceiver {
    pub(super) fn new(place: &Place, spin: bool) -> Result<Self, BenchError> {
        let port = node(place)?.state_subscriber(TOPIC, BUFFER);
        Ok(Self {
            port: port.map_err(failed)?,
            spin,
        })
    }
}

impl Receiver for OwnReceiver {
    fn receive(&mut self, patience: Duration) -> Result<Option<Stamp>, BenchError> {
        let port = &mut self.port;
        look(self.spin, patience, || {
            let sample = port.receive().map_err(failed)?;
            Ok(sample.map(|sample| stamp(sample.header())))
        })
    }
}

impl BareSender {
    pub(super) fn new(place: &Place, bodies: usize) -> Result<Self, BenchError> {
        let opened = open(place)?;
        let port = opened
            .1
            .publisher_builder()
            .initial_max_slice_len(bodies)
            .backpressure_strategy(BackpressureStrategy::DiscardData);
        Ok(Self {
            port: port.create().map_err(failed)?,
            bodies: vec![BodySample::default(); bodies],
            opened,
        })
    }

    pub(super) fn node(&self) -> &Node<Service> {
        &self.opened.0
    }
}

impl Sender for BareSender {
    fn send(&mut self, stamp: Stamp) -> Result<(), BenchError> {
        let bodies = &self.bodies;
        let mut sample = self.port.loan_slice_uninit(bodies.len()).map_err(failed)?;
        *sample.user_header_mut() = header(stamp);
        let sent = sample.write_from_fn(|body| bodies[body]).send();
        sent.map(drop).map_err(failed)
    }
}

impl BareReceiver {
    pub(super) fn new(place: &Place, spin: bool) -> Result<Self, BenchError> {
        let opened = open(place)?;
        let port = opened.1.subscriber_builder().buffer_size(BUFFER);
        Ok(Self {
            port: port.create().map_err(failed)?,
            spin,
            opened,
        })
    }

    pub(super) fn node(&self) -> &Node<Service> {
        &self.opened.0
    }
}

impl Receiver for BareReceiver {
    fn receive(&mut self, patience: Duration) -> Result<Option<Stamp>, BenchError> {
        let port = &self.port;
        look(self.spin, patience, || {
            let sample = port.receive().map_err(failed)?;
            Ok(sample.map(|sample| stamp(sample.user_header())))
        })
    }
}
