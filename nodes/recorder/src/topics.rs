//! What is recorded from DDS.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

use lgvi_middleware::ros::{Qos, RawSubscription, RosNode, TopicInfo};
use lgvi_middleware::{Environment, NodeArgs, Shutdown};
use lgvi_msgs::{MessageType, lookup};
use lgvi_node::NodeError;
use tracing::{info, warn};

use crate::config::Config;
use crate::drain::drain;
use crate::log_time::{LogTimes, StateTime};
use crate::seen::Seen;
use crate::sink::Record;
use crate::stamp::Stamped;

/// Depth of a subscription.
const DEPTH: usize = 8192;

/// How often the graph is asked for new topics and publishers.
const DISCOVERY: Duration = Duration::from_millis(200);

/// Topics that are the middleware's own.
const INTERNAL: [&str; 2] = ["/parameter_events", "/ros_discovery_info"];

/// What a subscription requests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Request {
    /// Everything of publishers that keep samples for late joiners, and what they have kept.
    Latched,
    /// Everything of reliable publishers, from the match on.
    Reliable,
    /// What arrives, of every publisher.
    Sensor,
}

/// Topics from DDS.
pub(crate) struct Topics {
    /// Every topic of a known type is recorded as soon as it is discovered.
    all: bool,
    /// Topics that come from shared memory instead.
    elsewhere: Vec<String>,
    participants: Participants,
    sources: BTreeMap<String, Source>,
    times: LogTimes,
    asked: Instant,
}

/// A topic and all of its subscriptions.
struct Source {
    topic: Arc<str>,
    message_type: MessageType,
    stamped: Stamped,
    subscriptions: Vec<(Request, RawSubscription)>,
    /// A publisher may be matched with several of the subscriptions.
    seen: Seen,
}

/// RustDDS 0.15 keeps one cache for each topic of a participant: what one reader of it is told that it will not get,
/// such as history from before a volatile match, another one is not given any more when it arrives. Hence no two
/// subscriptions to a topic share a participant: each topic's first is the node's, its second the next one's.
struct Participants(Vec<RosNode>);

impl Topics {
    pub(crate) fn open(
        config: &Config,
        ros: RosNode,
        elsewhere: Vec<String>,
        states: Arc<StateTime>,
    ) -> Result<Self, NodeError> {
        let mut topics = Self {
            all: config.topics.is_none(),
            elsewhere,
            participants: Participants(vec![ros]),
            sources: BTreeMap::new(),
            times: LogTimes::new(config.use_sim_time, states),
            asked: Instant::now(),
        };
        for chosen in config.topics.iter().flatten() {
            // Before any publisher is known, so that nothing is missed of those that keep samples.
            let mut source = Source::new(&chosen.name, chosen.message_type);
            source.subscribe(Request::Latched, &mut topics.participants)?;
            topics.sources.insert(source.topic.to_string(), source);
        }
        Ok(topics)
    }

    /// Subscribes to topics that have come up since, and to publishers whose offers no subscription has matched yet.
    fn discover(&mut self) -> Result<(), NodeError> {
        if self.asked.elapsed() < DISCOVERY {
            return Ok(());
        }
        self.asked = Instant::now();
        for topic in self.participants.topics() {
            if topic.publishers == 0 {
                continue;
            }
            if !self.sources.contains_key(&topic.name) {
                let unwanted = !self.all
                    || INTERNAL.contains(&topic.name.as_str())
                    || self.elsewhere.contains(&topic.name);
                match lookup(&topic.type_name) {
                    Some(message_type) if !unwanted => self
                        .sources
                        .insert(topic.name.clone(), Source::new(&topic.name, message_type)),
                    _ => continue,
                };
            }
            if let Some(source) = self.sources.get_mut(&topic.name)
                && source.message_type.name == topic.type_name
            {
                for request in requests(&topic) {
                    source.subscribe(*request, &mut self.participants)?;
                }
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
        // The writing thread ends before this one only when it has failed, which it says itself.
        let write = |record| drop(queue.send(record));
        let drained = drain(shutdown, || {
            self.discover()?;
            self.times.release(write);
            let mut found = false;
            for source in self.sources.values_mut() {
                found |= source.receive(&mut self.times, write);
            }
            let missing = self.sources.values().map(Source::lost).sum();
            lost.store(missing, Ordering::Relaxed);
            Ok(found)
        });
        self.times.finish(write);
        drained
    }
}

impl Source {
    fn new(topic: &str, message_type: MessageType) -> Self {
        Self {
            topic: Arc::from(topic),
            message_type,
            stamped: Stamped::of(&message_type),
            subscriptions: Vec::new(),
            seen: Seen::default(),
        }
    }

    /// Subscribes, unless it has.
    fn subscribe(
        &mut self,
        request: Request,
        participants: &mut Participants,
    ) -> Result<(), NodeError> {
        if self.subscriptions.iter().any(|(made, _)| *made == request) {
            return Ok(());
        }
        let count = self.subscriptions.len();
        let subscription = participants
            .get(count)?
            .raw_subscription(&self.topic, self.message_type.name, &request.qos())
            .map_err(NodeError::runtime)?;
        if count == 0 {
            self.topic = Arc::from(subscription.topic());
            info!("recording {}", self.topic);
        }
        self.subscriptions.push((request, subscription));
        Ok(())
    }

    /// Takes what has arrived; whether that is anything.
    fn receive(&mut self, times: &mut LogTimes, write: impl Fn(Record)) -> bool {
        let mut found = false;
        for (_, subscription) in &self.subscriptions {
            // No more than has room to wait: others are not kept waiting by publishers that are faster than this.
            for _ in 0..DEPTH {
                let sample = match subscription.take() {
                    Ok(Some(sample)) => sample,
                    Ok(None) => break,
                    Err(error) => {
                        warn!("{error}");
                        break;
                    }
                };
                found = true;
                if !self.seen.insert(sample.info.writer, sample.info.sequence) {
                    continue;
                }
                let stamp = self.stamped.read(&sample.message);
                let record = Record {
                    topic: Arc::clone(&self.topic),
                    message_type: self.message_type,
                    depth: DEPTH as u32,
                    log_time: sample.info.received_time,
                    publish_time: stamp
                        .or(sample.info.source_time)
                        .unwrap_or(sample.info.received_time),
                    sequence: sample.info.sequence,
                    cdr: sample.message,
                };
                times.log(record, stamp, &write);
            }
        }
        found
    }

    /// What one subscription has lost another may have received.
    fn lost(&self) -> u64 {
        match &*self.subscriptions {
            [(_, only)] => only.lost(),
            _ => self.seen.missing(),
        }
    }
}

impl Request {
    fn qos(self) -> Qos {
        match self {
            Self::Latched => Qos::latched(DEPTH),
            Self::Reliable => Qos::reliable(DEPTH),
            Self::Sensor => Qos::sensor(DEPTH),
        }
    }
}

/// What must be requested to get from each publisher of a topic the most that it offers.
fn requests(topic: &TopicInfo) -> &'static [Request] {
    use Request::{Latched, Reliable, Sensor};
    let one = topic.publishers == 1;
    match (topic.reliable, topic.durable) {
        (true, true) => &[Latched],
        (true, false) if one => &[Reliable],
        (false, _) if one => &[Sensor],
        // Nobody says which of them offers what.
        (true, false) => &[Latched, Reliable],
        (false, true) => &[Latched, Sensor],
        (false, false) => &[Latched, Reliable, Sensor],
    }
}

impl Participants {
    /// The topics of others, as the node itself sees them.
    fn topics(&self) -> Vec<TopicInfo> {
        self.0.first().map(RosNode::topics).unwrap_or_default()
    }

    fn get(&mut self, index: usize) -> Result<&RosNode, NodeError> {
        while self.0.len() <= index {
            let next = self.another()?;
            self.0.push(next);
        }
        Ok(&self.0[index])
    }

    /// Named after the node, without its remappings: the topics that are subscribed to here are resolved already.
    fn another(&self) -> Result<RosNode, NodeError> {
        let node = self.0[0].fully_qualified_name();
        let (namespace, name) = node.rsplit_once('/').unwrap_or_default();
        let name = format!("{name}_{}", self.0.len() + 1);
        let mut line = Vec::new();
        if !namespace.is_empty() {
            line = vec![
                "--ros-args".to_owned(),
                "-r".into(),
                format!("__ns:={namespace}"),
            ];
        }
        let (args, _) = NodeArgs::parse(&name, line).map_err(NodeError::runtime)?;
        let environment = Environment::from_env().map_err(NodeError::runtime)?;
        RosNode::new(&args, &environment).map_err(NodeError::runtime)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_cover_every_publisher() {
        let requests = |publishers, reliable, durable| {
            requests(&TopicInfo {
                name: "/topic".into(),
                type_name: "rosgraph_msgs/msg/Clock".into(),
                publishers,
                reliable,
                durable,
                subscriptions: 0,
            })
        };
        assert_eq!(requests(1, true, true), [Request::Latched]);
        assert_eq!(requests(1, true, false), [Request::Reliable]);
        assert_eq!(requests(1, false, true), [Request::Sensor]);
        assert_eq!(requests(1, false, false), [Request::Sensor]);
        assert_eq!(requests(3, true, true), [Request::Latched]);
        let several = requests(2, true, false);
        assert_eq!(several, [Request::Latched, Request::Reliable]);
        let several = requests(2, false, false);
        assert_eq!(
            several,
            [Request::Latched, Request::Reliable, Request::Sensor]
        );
    }
}
