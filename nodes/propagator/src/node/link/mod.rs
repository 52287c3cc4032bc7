//! The second thread: the node's ROS side, and the controls that come in over shared memory or DDS.
//!
//! The flight's loop holds one end ([`LinkEnd`]), the thread the other ([`service`]); between them are lock-free queues of
//! preallocated snapshots and of checked control sequences.

mod clock;
mod commands;
mod counted;
mod end;
mod late;
mod sensors;
mod sequences;
mod service;
mod settling;
mod topics;

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock, mpsc};
use std::time::Duration;

use lgvi_middleware::node::{Node, NodeError};
use lgvi_middleware::shm::ShmNode;
use lgvi_msgs::msg::{ControlSequence, Intervention};
use lgvi_msgs::shm::Name;
use lgvi_scene::Scene;
use rtrb::RingBuffer;
use thiserror::Error;

use self::commands::Commands;
use self::sequences::Sequences;
use self::service::Link;
use self::topics::Topics;
use crate::ControlError;
use crate::node::config::{Config, Rates};
use crate::node::messages::Snapshot;
use crate::node::monitor::Monitor;
use crate::node::sensors::Listened;

pub(crate) use self::end::{LinkEnd, Wait};

/// Snapshots between the loop and the ROS side: at 1 kHz as long as two publishers wait for one that does not keep up.
const SNAPSHOTS: usize = 256;

/// Control sequences on their way to the loop.
const SEQUENCES: usize = 8;

/// Commands on their way to the loop, and back as sequences that are flown.
const COMMANDS: usize = 256;

/// Readings of sensors on their way to the ROS side, in a scene that has any.
const READINGS: usize = 1024;

/// What has become of what came in, in the order in which the loop has taken it.
enum Verdict {
    /// A sequence was accepted at a step, or refused.
    Answer(Result<u64, ControlError>),
    /// A command is flown as this sequence.
    Flown(Box<ControlSequence>),
}

/// Messages published, by topic.
pub(crate) type Published = BTreeMap<String, u64>;

/// What both threads see.
#[derive(Default)]
struct Shared {
    /// Somebody wants to know how the flight is.
    wanted: AtomicBool,
    /// Odometry, tf and invariants have the subscribers that were asked for.
    attended: AtomicBool,
    /// Sensors that somebody listens to.
    listened: Listened,
    /// A control sequence was malformed.
    bad_control: OnceLock<ControlError>,
    /// Something that must not be published.
    fault: OnceLock<String>,
}

/// What ends the flight because of its ROS side.
#[derive(Debug, Error)]
pub(crate) enum LinkError {
    /// A control sequence is malformed.
    #[error("control sequence: {0}")]
    BadControl(ControlError),
    /// Something must not be published.
    #[error("{0}")]
    Fault(String),
    /// Nobody publishes, and takes in controls, any more.
    #[error("the thread of the ROS side has ended before the flight")]
    Ended,
}

impl From<LinkError> for NodeError {
    fn from(error: LinkError) -> Self {
        match error {
            LinkError::BadControl(_) => Self::input(error),
            LinkError::Fault(_) | LinkError::Ended => Self::runtime(error),
        }
    }
}

/// What the loop asks of the thread, which does it once all that was handed over before is published.
enum Request {
    /// Say what has been published, once it is acknowledged or the time has passed; takes the place of one before.
    Settle(Duration, mpsc::Sender<Published>),
    /// Publish that the course has been changed, and for a new one hand over again what the first began with.
    Intervene(Box<Intervention>, mpsc::Sender<()>),
    /// End.
    Close,
}

/// Opens the node's topics and starts the second thread.
pub(crate) fn start(
    node: &Node,
    shm: &ShmNode,
    config: &Config,
    rates: &Rates,
    scene: &Arc<Scene>,
    names: &[Name],
    monitor: &Arc<Monitor>,
) -> Result<LinkEnd, NodeError> {
    let lossless = Arc::new(AtomicBool::new(rates.lossless()));
    let readings = if scene.sensors.is_empty() {
        0
    } else {
        READINGS
    };
    let (readings_in, readings_out) = RingBuffer::new(readings);
    let topics = Topics::new(node, scene, config.clock, &lossless, readings_out)?;
    let counts = topics.counts();
    let (filled_in, filled_out) = RingBuffer::new(SNAPSHOTS);
    let (mut empty_in, empty_out) = RingBuffer::new(SNAPSHOTS);
    let (controls_in, controls_out) = RingBuffer::new(SEQUENCES);
    let (verdicts_in, verdicts_out) = RingBuffer::new(SEQUENCES + COMMANDS);
    let (commands_in, commands_out) = RingBuffer::new(COMMANDS);
    for _ in 0..SNAPSHOTS {
        let _ = empty_in.push(Snapshot::new(scene));
    }
    let shared = Arc::new(Shared {
        listened: scene
            .sensors
            .iter()
            .map(|_| AtomicBool::default())
            .collect(),
        ..Shared::default()
    });
    let (requests_in, requests_out) = mpsc::channel();
    let mut link = Link {
        system: scene.system(),
        scene: Arc::clone(scene),
        names: names.to_vec(),
        topics,
        monitor: Arc::clone(monitor),
        sequences: Sequences::new(&node.ros, shm, "~/control_sequence")?,
        commands: Commands::new(&node.ros, scene, &config.wrenches, commands_in)?,
        filled: filled_out,
        empty: empty_in,
        controls: controls_in,
        verdicts: verdicts_out,
        requests: requests_out,
        held: Vec::new(),
        pending: VecDeque::new(),
        initial: VecDeque::new(),
        settling: None,
        late: late::Late::default(),
        feedback: config.feedback,
        stop_on_bad_control: config.stop_on_bad_control,
        shared: Arc::clone(&shared),
    };
    link.announce_scene()?;
    let await_subscribers = config.await_subscribers;
    let thread = std::thread::Builder::new()
        .name("ros".into())
        .spawn(move || link.serve(await_subscribers))
        .map_err(NodeError::runtime)?;
    Ok(LinkEnd {
        filled: filled_in,
        empty: empty_out,
        controls: controls_out,
        verdicts: verdicts_in,
        commands: commands_out,
        readings: readings_in,
        requests: requests_in,
        counts,
        lossless,
        shutdown: node.shutdown.clone(),
        shared,
        thread,
    })
}
