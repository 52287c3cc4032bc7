//! The second thread: the node's ROS side, and the controls that come in over shared memory or DDS.
//!
//! The flight's loop holds one end ([`LinkEnd`]), the thread the other ([`service`]); between them are lock-free queues of
//! preallocated snapshots and of checked control sequences.

mod end;
mod service;
mod topics;

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock, mpsc};

use lgvi_middleware::Shutdown;
use lgvi_middleware::ros::{Qos, RosNode};
use lgvi_middleware::shm::ShmNode;
use lgvi_msgs::shm::Name;
use lgvi_node::NodeError;
use lgvi_scene::Scene;
use rtrb::RingBuffer;

use self::service::Link;
use self::topics::Topics;
use crate::ControlError;
use crate::config::Config;
use crate::messages::Snapshot;

pub(crate) use self::end::LinkEnd;

/// Snapshots between the loop and the ROS side.
const SNAPSHOTS: usize = 64;

/// Control sequences on their way to the loop.
const SEQUENCES: usize = 8;

/// Messages published, by topic.
pub(crate) type Published = BTreeMap<String, u64>;

/// What both threads see.
#[derive(Default)]
struct Shared {
    /// Odometry, tf and invariants have the subscribers that were asked for.
    attended: AtomicBool,
    /// The loop has ended: publish what is queued, then report.
    finish: AtomicBool,
    /// A control sequence was malformed.
    bad_control: OnceLock<ControlError>,
    /// Something that must not be published.
    fault: OnceLock<String>,
}

/// Opens the node's topics and starts the second thread.
pub(crate) fn start(
    ros: RosNode,
    shm: &ShmNode,
    config: &Config,
    scene: Arc<Scene>,
    names: Vec<Name>,
    shutdown: &Shutdown,
) -> Result<LinkEnd, NodeError> {
    let topics = Topics::new(&ros, &scene, config.lossless())?;
    let control_topic = ros
        .resolve("~/control_sequence")
        .map_err(NodeError::input)?;
    let (filled_in, filled_out) = RingBuffer::new(SNAPSHOTS);
    let (mut empty_in, empty_out) = RingBuffer::new(SNAPSHOTS);
    let (controls_in, controls_out) = RingBuffer::new(SEQUENCES);
    let (verdicts_in, verdicts_out) = RingBuffer::new(SEQUENCES);
    for _ in 0..SNAPSHOTS {
        let states = scene.bodies.iter().map(|body| body.state).collect();
        let _ = empty_in.push(Snapshot { step: 0, states });
    }
    let shared = Arc::new(Shared::default());
    let mut link = Link {
        system: scene.system(),
        names,
        topics,
        shm_controls: shm
            .control_subscriber(&control_topic)
            .map_err(NodeError::runtime)?,
        shm_feedback: shm
            .feedback_subscriber(&control_topic)
            .map_err(NodeError::runtime)?,
        ros_controls: [
            ros.subscription(&control_topic, &Qos::latched(SEQUENCES))
                .map_err(NodeError::runtime)?,
            ros.subscription(&control_topic, &Qos::reliable(SEQUENCES))
                .map_err(NodeError::runtime)?,
        ],
        filled: filled_out,
        empty: empty_in,
        controls: controls_in,
        verdicts: verdicts_out,
        held: Vec::new(),
        pending: VecDeque::new(),
        recent: VecDeque::new(),
        feedback: config.feedback,
        stop_on_bad_control: config.stop_on_bad_control,
        shared: Arc::clone(&shared),
        scene,
        _ros: ros,
    };
    link.announce_scene()?;
    let await_subscribers = config.await_subscribers;
    let stop = shutdown.clone();
    let (report, published) = mpsc::channel();
    let thread = std::thread::Builder::new()
        .name("ros".into())
        .spawn(move || link.serve(await_subscribers, &report, &stop))
        .map_err(NodeError::runtime)?;
    Ok(LinkEnd {
        filled: filled_in,
        empty: empty_out,
        controls: controls_out,
        verdicts: verdicts_in,
        published,
        shared,
        thread,
        shutdown: shutdown.clone(),
    })
}
