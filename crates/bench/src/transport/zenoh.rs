//! Zenoh: where nodes meet, and the same topic by the library alone.

use std::time::{Duration, Instant};

use lgvi_middleware::{Environment, Rmw, ZenohSettings};
use lgvi_msgs::cdr;
use lgvi_msgs::msg::SystemState;
use zenoh::bytes::ZBytes;
use zenoh::handlers::FifoChannelHandler;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::CongestionControl;
use zenoh::sample::Sample;
use zenoh::{Config, Session, Wait};

use super::ros::{DEPTH, message, stamp};
use super::way::{Receiver, Sender, Stamp, TOPIC};
use super::{Place, failed};
use crate::error::BenchError;

/// The end that listens, the sender's, and the one that connects. No router: data goes from peer to peer with one, too.
#[derive(Clone, Copy)]
pub(super) enum End {
    Near,
    Far,
}

/// The session's settings that differ from those of rmw_zenoh_cpp.
fn settings(place: &Place, end: End) -> [(&'static str, String); 2] {
    let port = 20_000 + place.domain;
    let own = format!("[\"tcp/127.0.0.1:{port}\"]");
    let (listen, connect) = match end {
        End::Near => (own, "[]".to_owned()),
        End::Far => ("[\"tcp/127.0.0.1:0\"]".to_owned(), own),
    };
    [("listen/endpoints", listen), ("connect/endpoints", connect)]
}

/// A node's environment.
pub(super) fn environment(place: &Place, end: End) -> Environment {
    let pairs = settings(place, end).map(|(key, value)| format!("{key}={value}"));
    Environment {
        rmw: Rmw::Zenoh,
        zenoh: ZenohSettings {
            file: None,
            overrides: Some(pairs.join(";")),
        },
        ..Environment::localhost(place.domain)
    }
}

/// The library's end that sends.
pub(super) struct BareSender {
    port: Publisher<'static>,
    message: SystemState,
    _session: Session,
}

/// The library's end that receives.
pub(super) struct BareReceiver {
    port: Subscriber<FifoChannelHandler<Sample>>,
    _session: Session,
}

fn session(place: &Place, end: End) -> Result<Session, BenchError> {
    let mut config = Config::default();
    let fixed = [
        ("mode", "\"peer\"".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
    ];
    for (key, value) in fixed.into_iter().chain(settings(place, end)) {
        config.insert_json5(key, &value).map_err(failed)?;
    }
    zenoh::open(config).wait().map_err(failed)
}

fn key() -> &'static str {
    TOPIC.trim_start_matches('/')
}

impl BareSender {
    pub(super) fn new(place: &Place, bodies: usize) -> Result<Self, BenchError> {
        let session = session(place, End::Near)?;
        let port = session.declare_publisher(key());
        let port = port
            .congestion_control(CongestionControl::Block)
            .express(true);
        Ok(Self {
            port: port.wait().map_err(failed)?,
            message: message(bodies),
            _session: session,
        })
    }
}

impl Sender for BareSender {
    fn send(&mut self, stamp: Stamp) -> Result<(), BenchError> {
        self.message.sequence = stamp.sequence;
        self.message.step = stamp.nanoseconds;
        let bytes = cdr::encode(&self.message).map_err(failed)?;
        self.port.put(ZBytes::from(bytes)).wait().map_err(failed)
    }
}

impl BareReceiver {
    pub(super) fn new(place: &Place) -> Result<Self, BenchError> {
        let session = session(place, End::Far)?;
        let port = session.declare_subscriber(key());
        let port = port.with(zenoh::handlers::FifoChannel::new(DEPTH));
        Ok(Self {
            port: port.wait().map_err(failed)?,
            _session: session,
        })
    }
}

impl Receiver for BareReceiver {
    fn receive(&mut self, patience: Duration) -> Result<Option<Stamp>, BenchError> {
        let sample = self.port.recv_deadline(Instant::now() + patience);
        let Some(sample) = sample.map_err(failed)? else {
            return Ok(None);
        };
        let message = cdr::decode(&sample.payload().to_bytes()).map_err(failed)?;
        Ok(Some(stamp(&message)))
    }
}
