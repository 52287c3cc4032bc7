//! What is recorded from shared memory.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::SyncSender;

use lgvi_middleware::Shutdown;
use lgvi_middleware::shm::{ShmNode, StateSubscriber};
use lgvi_msgs::msg::SystemState;
use lgvi_msgs::{MessageType, cdr};
use lgvi_node::NodeError;

use crate::config::Config;
use crate::drain::drain;
use crate::log_time::StateTime;
use crate::sink::Record;

/// Places in a state subscription.
const STATE_BUFFER: usize = 1024;

/// States from shared memory.
pub(crate) struct States {
    subscribers: Vec<(Arc<str>, StateSubscriber)>,
    message_type: MessageType,
    frame: String,
    use_sim_time: bool,
    time: Arc<StateTime>,
}

impl States {
    pub(crate) fn open(
        config: &Config,
        shm: &ShmNode,
        time: Arc<StateTime>,
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
            time,
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
                // No more than has room to wait.
                for _ in 0..STATE_BUFFER {
                    let Some(sample) = subscriber.receive().map_err(NodeError::runtime)? else {
                        break;
                    };
                    found = true;
                    let header = *sample.header();
                    let message = header
                        .to_message(sample.elements(), &self.frame)
                        .map_err(NodeError::runtime)?;
                    drop(sample);
                    let stamp = header.stamp_nanoseconds;
                    self.time.set(stamp);
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

/// Wall-clock time (ns since the UNIX epoch).
fn now() -> i64 {
    chrono::Utc::now().timestamp_nanos_opt().unwrap_or(i64::MAX)
}
