use std::time::{Duration, Instant};

use lgvi_bag::BagReader;
use lgvi_middleware::ros::Qos;
use lgvi_msgs::rosgraph_msgs::Clock;
use lgvi_msgs::stamp;
use lgvi_node::{Event, Node, NodeError};
use tracing::{info, warn};

use crate::channels::Channels;
use crate::config::Config;

/// How often waiting looks whether it is over.
const WAIT: Duration = Duration::from_millis(1);

/// Recorded time between two clock messages (ns).
const CLOCK_PERIOD: u64 = 10_000_000;

/// The node's work, from parameters to the last message.
pub(crate) fn run(node: &mut Node) -> Result<(), NodeError> {
    let config = Config::take(std::mem::take(&mut node.parameters))?;
    let bag = BagReader::open(&config.bag).map_err(NodeError::input)?;
    let (ros, _rosout) = node.ros()?;
    let shm = node.shm()?;
    let mut channels = Channels::open(&bag, &ros, &shm, config.lossless())?;
    let clock = config
        .clock
        .then(|| ros.publisher::<Clock>("/clock", &Qos::reliable(10)))
        .transpose()
        .map_err(NodeError::runtime)?;
    node.report(&Event::Ready);

    while !node.shutdown.requested() && !channels.have_subscribers(config.await_subscribers)? {
        std::thread::sleep(WAIT);
    }

    let start = Instant::now();
    let mut first = None;
    let mut clock_due = 0;
    let mut messages = 0;
    for message in bag.messages() {
        let message = message.map_err(NodeError::input)?;
        let first = *first.get_or_insert(message.log_time);
        if !config.lossless() {
            let recorded = Duration::from_nanos(message.log_time.saturating_sub(first));
            let due = Duration::try_from_secs_f64(recorded.as_secs_f64() / config.rate)
                .unwrap_or(Duration::MAX);
            node.shutdown
                .wait_timeout(due.saturating_sub(start.elapsed()));
        }
        if node.shutdown.requested() {
            break;
        }
        if let Some(clock) = &clock
            && message.log_time >= clock_due
        {
            clock_due = message.log_time.saturating_add(CLOCK_PERIOD);
            let time = i64::try_from(message.log_time).map_err(NodeError::input)?;
            let time = stamp::to_message(time).map_err(NodeError::input)?;
            if let Err(error) = clock.publish(&Clock { clock: time }) {
                warn!("{error}");
            }
        }
        channels.publish(message)?;
        messages += 1;
    }
    channels.settle();
    info!("played {messages} messages");
    node.report(&Event::Played { messages });
    Ok(())
}
