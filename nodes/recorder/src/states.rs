//! What is recorded from shared memory.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use lgvi_bag::{History, Qos, ROS2MSG, Topic};
use lgvi_middleware::Shutdown;
use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::Clock;
use lgvi_middleware::shm::{ShmNode, StateSubscriber};
use lgvi_msgs::msg::SystemState;
use lgvi_msgs::shm::{BodySample, StateHeader};
use lgvi_msgs::{RosMessage, cdr};
use tracing::{info, warn};

use crate::account::{Account, Track};
use crate::batch::Head;
use crate::config::Config;
use crate::drain::{Looked, drain};
use crate::log_time::{LogTime, StateTime};
use crate::outlet::Outlet;

/// Places in a state subscription: 0.8 s of 10 kHz, for as long as the thread may have to wait for a processor.
const STATE_BUFFER: usize = 8192;

/// The shortest and the longest pause between two looks. A publisher that has been held up catches up at some 200 000
/// states a second: the places must do for that.
const PAUSE: (Duration, Duration) = (Duration::from_micros(100), Duration::from_millis(2));

/// States from shared memory.
pub(crate) struct States {
    sources: Vec<Source>,
    log_time: LogTime,
    clock: Clock,
    time: Arc<StateTime>,
    paused: Arc<AtomicBool>,
}

/// A topic of states.
struct Source {
    subscriber: StateSubscriber,
    place: usize,
    track: Arc<Track>,
    /// The last state, whose memory is used again for the next.
    message: SystemState,
    /// States that no message can hold.
    unusable: u64,
}

impl States {
    /// Subscribes to topics by their absolute names.
    pub(crate) fn open(
        config: &Config,
        topics: &[String],
        shm: &ShmNode,
        clock: Clock,
        time: Arc<StateTime>,
        paused: Arc<AtomicBool>,
        account: &Account,
    ) -> Result<Self, NodeError> {
        let open = |topic: &String| {
            let subscriber = shm.state_subscriber(topic, STATE_BUFFER)?;
            let (place, track) = account.add(topic);
            track.topic.get_or_init(|| describe(topic));
            info!("recording {topic} from shared memory");
            let mut message = SystemState::default();
            message.header.frame_id = config.frame_of(topic);
            Ok::<_, NodeError>(Source {
                subscriber,
                place,
                track,
                message,
                unusable: 0,
            })
        };
        Ok(Self {
            sources: topics.iter().map(open).collect::<Result<_, _>>()?,
            log_time: config.log_time,
            clock,
            time,
            paused,
        })
    }

    /// The topics.
    pub(crate) fn tracks(&self) -> impl Iterator<Item = Arc<Track>> {
        self.sources.iter().map(|source| Arc::clone(&source.track))
    }

    /// Receives until the shutdown.
    pub(crate) fn run(mut self, mut outlet: Outlet, shutdown: &Shutdown) -> Result<(), NodeError> {
        let mut pause = PAUSE.1;
        drain(shutdown, || {
            let mut most = 0;
            for source in 0..self.sources.len() {
                most = most.max(self.receive(source, &mut outlet)?);
            }
            outlet.tick();
            // So that a small part of the places is in use at the next look.
            if most > STATE_BUFFER / 4 {
                pause = PAUSE.0;
            } else if most > STATE_BUFFER / 8 {
                pause = (pause / 2).max(PAUSE.0);
            } else if most < STATE_BUFFER / 16 {
                pause = (2 * pause).min(PAUSE.1);
            }
            Ok(Looked {
                found: most > 0,
                pause,
                over: outlet.is_over(),
            })
        })
    }

    /// Takes what has arrived on one topic; how many samples.
    fn receive(&mut self, index: usize, outlet: &mut Outlet) -> Result<usize, NodeError> {
        let source = &mut self.sources[index];
        let mut received = 0;
        // No more than has room to wait.
        while received < STATE_BUFFER {
            let sample = source.subscriber.receive()?;
            let Some(sample) = sample else {
                break;
            };
            received += 1;
            let (header, bodies) = (sample.header(), sample.elements());
            let stamp = header.stamp_nanoseconds;
            self.time.set(stamp);
            if self.paused.load(Ordering::Relaxed) {
                source.track.left_out.fetch_add(1, Ordering::Relaxed);
                continue;
            }
            let head = Head {
                publisher: 0,
                track: source.place,
                log_time: log_time(self.log_time, &self.clock, stamp),
                publish_time: stamp,
                sequence: header.sequence,
            };
            let message = &mut source.message;
            match outlet.put_with(head, |cdr| encode(cdr, header, bodies, message)) {
                Ok(()) => {
                    source.track.received.fetch_add(1, Ordering::Relaxed);
                }
                Err(why) => {
                    if source.unusable == 0 {
                        warn!("{}: a state cannot be recorded: {why}", source.track.name);
                    }
                    source.unusable += 1;
                }
            }
        }
        let in_memory = received > 0 || source.subscriber.publishers() > 0;
        source.track.in_memory.store(in_memory, Ordering::Relaxed);
        let lost = source.subscriber.lost() + source.unusable;
        source.track.lost.store(lost, Ordering::Relaxed);
        Ok(received)
    }
}

fn encode(
    cdr: &mut Vec<u8>,
    header: &StateHeader,
    bodies: &[BodySample],
    message: &mut SystemState,
) -> Result<(), String> {
    header
        .update_message(bodies, message)
        .map_err(|error| error.to_string())?;
    cdr::encode_into(cdr, message).map_err(|error| error.to_string())
}

/// When a state is logged; before the first time on `/clock`, at its stamp.
fn log_time(by: LogTime, clock: &Clock, stamp: i64) -> i64 {
    match by {
        LogTime::Stamp => stamp,
        LogTime::Received => match clock.now() {
            0 => stamp,
            now => now,
        },
    }
}

/// How a topic of states stands in the bag.
fn describe(topic: &str) -> Topic {
    Topic {
        name: topic.to_owned(),
        type_name: SystemState::TYPE_NAME.into(),
        type_hash: SystemState::TYPE_HASH.into(),
        definition: SystemState::DEFINITION.into(),
        definition_encoding: ROS2MSG.to_owned(),
        qos: Qos {
            reliable: true,
            durable: false,
            history: History::KeepLast,
            depth: STATE_BUFFER as u32,
        },
    }
}
