//! The recorded time on `/clock`.

use std::time::{Duration, Instant};

use lgvi_middleware::ros::{Publisher, Qos, RosNode};
use lgvi_msgs::rosgraph_msgs;
use lgvi_msgs::stamp;
use lgvi_node::NodeError;
use tracing::warn;

/// The topic.
pub(crate) const CLOCK: &str = "/clock";

/// How often a time that stands is published, for those who come later.
const REMINDER: Duration = Duration::from_secs(1);

/// Messages that are kept for those who do not keep up.
const DEPTH: usize = 10;

/// Publishes the time at which what is played was recorded. It goes on between messages, and stands in a pause.
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
        let publisher = ros
            .publisher(CLOCK, &Qos::reliable(DEPTH))
            .map_err(NodeError::runtime)?;
        Ok(Self {
            publisher,
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
        let time = i64::try_from(time).map_err(NodeError::input)?;
        let clock = stamp::to_message(time).map_err(NodeError::input)?;
        if let Err(error) = self.publisher.publish(&rosgraph_msgs::Clock { clock }) {
            warn!("{error}");
        }
        Ok(())
    }
}
