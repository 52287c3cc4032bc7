//! What the receiving threads do.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

use lgvi_middleware::Shutdown;
use lgvi_middleware::ros::{Qos, RawSubscription, RosNode, TopicInfo};
use lgvi_middleware::shm::{ShmNode, StateSubscriber};
use lgvi_msgs::msg::SystemState;
use lgvi_msgs::{MessageType, cdr, lookup};
use lgvi_node::NodeError;
use tracing::{info, warn};

use crate::config::{Chosen, Config};
use crate::sink::Record;
use crate::stamp::Stamped;

/// Places in a state subscription.
const STATE_BUFFER: usize = 1024;

/// Depth of a subscription over DDS.
const DEPTH: usize = 8192;

/// How often a source looks for messages when there are none.
const IDLE: Duration = Duration::from_micros(500);

/// How often the graph is asked for new topics.
const DISCOVERY: Duration = Duration::from_millis(200);

/// How long a source must be silent before it is taken to be drained.
const SILENCE: Duration = Duration::from_millis(100);

/// Topics that are the middleware's own.
const INTERNAL: [&str; 2] = ["/parameter_events", "/ros_discovery_info"];

/// Runs `poll` until the shutdown and after it until it has been silent for a while. It says whether it found something.
fn drain(
    shutdown: &Shutdown,
    mut poll: impl FnMut() -> Result<bool, NodeError>,
) -> Result<(), NodeError> {
    let mut heard = Instant::now();
    loop {
        if poll()? {
            heard = Instant::now();
        } else if shutdown.requested() && heard.elapsed() >= SILENCE {
            return Ok(());
        } else {
            std::thread::sleep(IDLE);
        }
    }
}

/// States from shared memory.
pub(crate) struct States {
    subscribers: Vec<(Arc<str>, StateSubscriber)>,
    message_type: MessageType,
    frame: String,
    use_sim_time: bool,
}

impl States {
    pub(crate) fn open(
        config: &Config,
        shm: &ShmNode,
        resolve: impl Fn(&str) -> Result<String, NodeError>,
    ) -> Result<Self, NodeError> {
        let open = |topic: &String| {
            let topic = resolve(topic)?;
            let subscriber = shm
                .state_subscriber(&topic, STATE_BUFFER)
                .map_err(NodeError::runtime)?;
            Ok((Arc::from(topic), subscriber))
        };
        Ok(Self {
            subscribers: config.states.iter().map(open).collect::<Result<_, _>>()?,
            message_type: MessageType::of::<SystemState>(),
            frame: config.frame.clone(),
            use_sim_time: config.use_sim_time,
        })
    }

    /// Receives until the shutdown; `lost` counts what is missing.
    pub(crate) fn run(
        mut self,
        queue: &SyncSender<Record>,
        lost: &AtomicU64,
        shutdown: &Shutdown,
    ) -> Result<(), NodeError> {
        drain(shutdown, || {
            let mut found = false;
            for (topic, subscriber) in &mut self.subscribers {
                while let Some(sample) = subscriber.receive().map_err(NodeError::runtime)? {
                    found = true;
                    let header = *sample.header();
                    let message = header
                        .to_message(sample.elements(), &self.frame)
                        .map_err(NodeError::runtime)?;
                    drop(sample);
                    let stamp = header.stamp_nanoseconds;
                    let record = Record {
                        topic: Arc::clone(topic),
                        message_type: self.message_type,
                        depth: STATE_BUFFER as u32,
                        log_time: if self.use_sim_time { stamp } else { now() },
                        publish_time: stamp,
                        sequence: header.sequence,
                        cdr: cdr::encode(&message).map_err(NodeError::runtime)?,
                    };
                    if queue.send(record).is_err() {
                        return Ok(false);
                    }
                }
            }
            let missing = self
                .subscribers
                .iter()
                .map(|(_, subscriber)| subscriber.lost())
                .sum();
            lost.store(missing, Ordering::Relaxed);
            Ok(found)
        })
    }
}

/// Topics from DDS.
pub(crate) struct Topics {
    ros: RosNode,
    /// Every topic of a known type is recorded as soon as it is discovered.
    all: bool,
    /// Topics that come from shared memory instead.
    elsewhere: Vec<String>,
    subscriptions: BTreeMap<String, Source>,
    use_sim_time: bool,
    /// Stamp of the last stamped message, for those that have none.
    latest: i64,
    asked: Instant,
}

struct Source {
    topic: Arc<str>,
    message_type: MessageType,
    stamped: Stamped,
    subscription: RawSubscription,
}

impl Topics {
    pub(crate) fn open(
        config: &Config,
        ros: RosNode,
        elsewhere: Vec<String>,
    ) -> Result<Self, NodeError> {
        let mut topics = Self {
            ros,
            all: config.topics.is_none(),
            elsewhere,
            subscriptions: BTreeMap::new(),
            use_sim_time: config.use_sim_time,
            latest: 0,
            asked: Instant::now(),
        };
        for chosen in config.topics.iter().flatten() {
            topics.subscribe(chosen, &Qos::latched(DEPTH))?;
        }
        Ok(topics)
    }

    fn subscribe(&mut self, chosen: &Chosen, qos: &Qos) -> Result<(), NodeError> {
        let subscription = self
            .ros
            .raw_subscription(&chosen.name, chosen.message_type.name, qos)
            .map_err(NodeError::runtime)?;
        let topic: Arc<str> = Arc::from(subscription.topic());
        info!("recording {topic}");
        let source = Source {
            topic: Arc::clone(&topic),
            message_type: chosen.message_type,
            stamped: Stamped::of(&chosen.message_type),
            subscription,
        };
        self.subscriptions.insert(topic.to_string(), source);
        Ok(())
    }

    /// Subscribes to topics that have come up since.
    fn discover(&mut self) -> Result<(), NodeError> {
        if !self.all || self.asked.elapsed() < DISCOVERY {
            return Ok(());
        }
        self.asked = Instant::now();
        for topic in self.ros.topics() {
            let known = INTERNAL.contains(&topic.name.as_str())
                || self.elsewhere.contains(&topic.name)
                || self.subscriptions.contains_key(&topic.name);
            if known || topic.publishers == 0 {
                continue;
            }
            if let Some(message_type) = lookup(&topic.type_name) {
                let qos = request(&topic);
                self.subscribe(
                    &Chosen {
                        name: topic.name,
                        message_type,
                    },
                    &qos,
                )?;
            }
        }
        Ok(())
    }

    /// Receives until the shutdown; `lost` counts what is missing.
    pub(crate) fn run(
        mut self,
        queue: &SyncSender<Record>,
        lost: &AtomicU64,
        shutdown: &Shutdown,
    ) -> Result<(), NodeError> {
        drain(shutdown, || {
            self.discover()?;
            let mut found = false;
            for source in self.subscriptions.values() {
                loop {
                    let sample = match source.subscription.take() {
                        Ok(Some(sample)) => sample,
                        Ok(None) => break,
                        Err(error) => {
                            warn!("{error}");
                            break;
                        }
                    };
                    found = true;
                    let stamp = source.stamped.read(&sample.message);
                    self.latest = stamp.unwrap_or(self.latest);
                    let record = Record {
                        topic: Arc::clone(&source.topic),
                        message_type: source.message_type,
                        depth: DEPTH as u32,
                        log_time: if self.use_sim_time {
                            self.latest
                        } else {
                            sample.info.received_time
                        },
                        publish_time: stamp
                            .or(sample.info.source_time)
                            .unwrap_or(sample.info.received_time),
                        sequence: sample.info.sequence,
                        cdr: sample.message,
                    };
                    if queue.send(record).is_err() {
                        return Ok(false);
                    }
                }
            }
            let missing = self
                .subscriptions
                .values()
                .map(|source| source.subscription.lost())
                .sum();
            lost.store(missing, Ordering::Relaxed);
            Ok(found)
        })
    }
}

/// The most that all publishers of a topic offer.
fn request(topic: &TopicInfo) -> Qos {
    match (topic.reliable, topic.durable) {
        (true, true) => Qos::latched(DEPTH),
        (true, false) => Qos::reliable(DEPTH),
        (false, _) => Qos::sensor(DEPTH),
    }
}

/// Wall-clock time (ns since the UNIX epoch).
fn now() -> i64 {
    chrono::Utc::now().timestamp_nanos_opt().unwrap_or(i64::MAX)
}
