//! The recorded time on `/clock`.

use lgvi_middleware::ros::{Publisher, Qos, RosNode};
use lgvi_msgs::rosgraph_msgs;
use lgvi_msgs::stamp;
use lgvi_node::NodeError;
use tracing::warn;

/// Recorded time between two messages at least (ns).
const PERIOD: u64 = 10_000_000;

/// Messages that are kept for those who do not keep up.
const DEPTH: usize = 10;

/// Publishes the time at which what is played was recorded.
pub(crate) struct RecordedClock {
    publisher: Publisher<rosgraph_msgs::Clock>,
    /// What was published last (ns).
    told: Option<u64>,
}

impl RecordedClock {
    pub(crate) fn new(ros: &RosNode) -> Result<Self, NodeError> {
        let publisher = ros
            .publisher("/clock", &Qos::reliable(DEPTH))
            .map_err(NodeError::runtime)?;
        Ok(Self {
            publisher,
            told: None,
        })
    }

    /// Publishes the time of a message (ns) where it is due.
    pub(crate) fn tell(&mut self, time: u64) -> Result<(), NodeError> {
        match self.told {
            Some(told) if time < told.saturating_add(PERIOD) => Ok(()),
            _ => self.publish(time),
        }
    }

    /// Publishes the time of the last message (ns), unless it has been published.
    pub(crate) fn tell_last(&mut self, time: u64) -> Result<(), NodeError> {
        match self.told {
            Some(told) if told < time => self.publish(time),
            _ => Ok(()),
        }
    }

    fn publish(&mut self, time: u64) -> Result<(), NodeError> {
        self.told = Some(time);
        let time = i64::try_from(time).map_err(NodeError::input)?;
        let clock = stamp::to_message(time).map_err(NodeError::input)?;
        if let Err(error) = self.publisher.publish(&rosgraph_msgs::Clock { clock }) {
            warn!("{error}");
        }
        Ok(())
    }
}
