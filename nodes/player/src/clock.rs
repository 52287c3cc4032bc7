//! The recorded time on `/clock`.

use std::time::{Duration, Instant};

use lgvi_bag::BagReader;
use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{Publisher, Qos, RosNode};
use lgvi_msgs::rosgraph_msgs;
use lgvi_msgs::stamp;
use tracing::warn;

use crate::range::Range;
use crate::reel;

/// The topic.
pub(crate) const CLOCK: &str = "/clock";

/// How often a time that stands is published, for those who come later.
const REMINDER: Duration = Duration::from_secs(1);

/// The last time that it can tell (ns): its seconds have 32 bits.
const LAST: u64 = (1 << 31) * 1_000_000_000 - 1;

/// Refuses a bag with a message to be played that was recorded at a time that `/clock` cannot tell.
pub(crate) fn check(bag: &BagReader, wanted: &[bool], range: Range) -> Result<(), NodeError> {
    let mut late = reel::chosen(bag, range.start.max(LAST + 1), wanted);
    match late.next().transpose().map_err(NodeError::input)? {
        Some(message) if message.log_time <= range.end => {
            Err(too_late(&message.topic.name, message.log_time))
        }
        _ => Ok(()),
    }
}

fn too_late(what: &str, time: u64) -> NodeError {
    NodeError::Input(format!(
        "{what} at {time} ns: {CLOCK} takes times up to {LAST} ns; play the bag without it"
    ))
}

/// Publishes the time at which what is played was recorded. It goes on between messages, and stands in a pause. Who comes
/// late hears the next one: an earlier one may be from before the player went back.
pub(crate) struct RecordedClock {
    publisher: Publisher<rosgraph_msgs::Clock>,
    /// Recorded time between two messages at least (ns).
    period: u64,
    /// What was published last (ns), and when.
    told: Option<(u64, Instant)>,
}

impl RecordedClock {
    /// `frequency` is how often it is published a recorded second at most.
    pub(crate) fn new(ros: &RosNode, frequency: f64) -> Result<Self, NodeError> {
        Ok(Self {
            publisher: ros.publisher(CLOCK, &Qos::volatile(1))?,
            period: (1e9 / frequency).round() as u64,
            told: None,
        })
    }

    /// Recorded time between two messages at least.
    pub(crate) fn period(&self) -> Duration {
        Duration::from_nanos(self.period)
    }

    /// Publishes the recorded time (ns) where it is due.
    pub(crate) fn tell(&mut self, time: u64) -> Result<(), NodeError> {
        match self.told {
            Some((told, _)) if time < told.saturating_add(self.period) => Ok(()),
            _ => self.publish(time),
        }
    }

    /// Publishes the recorded time (ns) where somebody has set it, or at the end, unless it has been published.
    pub(crate) fn tell_now(&mut self, time: u64) -> Result<(), NodeError> {
        match self.told {
            Some((told, _)) if told == time => Ok(()),
            _ => self.publish(time),
        }
    }

    /// Publishes the time that stands again, where that is due.
    pub(crate) fn remind(&mut self) -> Result<(), NodeError> {
        match self.told {
            Some((time, when)) if when.elapsed() >= REMINDER => self.publish(time),
            _ => Ok(()),
        }
    }

    fn publish(&mut self, time: u64) -> Result<(), NodeError> {
        self.told = Some((time, Instant::now()));
        let stamp = i64::try_from(time).map(stamp::to_message);
        let Ok(Ok(clock)) = stamp else {
            return Err(too_late("the recorded time", time));
        };
        if let Err(error) = self.publisher.publish(&rosgraph_msgs::Clock { clock }) {
            warn!("{error}");
        }
        Ok(())
    }
}
