//! The flight's time on `/clock`.

use std::sync::Arc;
use std::time::{Duration, Instant};

use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{Qos, RosNode};
use lgvi_msgs::rosgraph_msgs::Clock;
use lgvi_msgs::stamp;
use lgvi_scene::Scene;

use super::counted::{Counted, Counts};

/// Between two messages at least.
const PERIOD: Duration = Duration::from_millis(10);

/// Between two messages of the same time: for who comes late to a flight that is paused, and for who has lost the last
/// one of a flight.
const REPEAT: Duration = Duration::from_secs(1);

/// Publishes the time of the step at which the flight is. Subscriptions of ROS 2 nodes are best effort, of depth 1; who
/// comes late hears the next time: an earlier one may be from before a reset.
pub(super) struct FlightClock {
    topic: Counted<Clock>,
    due: Instant,
    told: Option<(u64, Instant)>,
}

impl FlightClock {
    pub(super) fn new(ros: &RosNode) -> Result<Self, NodeError> {
        Ok(Self {
            topic: Counted::new(ros, "/clock", &Qos::volatile(1), &Arc::default())?,
            due: Instant::now(),
            told: None,
        })
    }

    /// Whether anybody has subscribed.
    pub(super) fn wanted(&self) -> bool {
        self.topic.wanted()
    }

    /// What becomes of the messages.
    pub(super) fn counts(&self) -> Arc<Counts> {
        self.topic.counts()
    }

    /// Publishes the time where it is due.
    pub(super) fn tell(&mut self, scene: &Scene, step: u64) {
        let now = Instant::now();
        let news = self
            .told
            .is_none_or(|(told, when)| told != step || now.duration_since(when) >= REPEAT);
        if news && now >= self.due {
            self.publish(scene, step, now);
        }
    }

    /// Publishes the time of the flight's end, unless it has been published.
    pub(super) fn tell_last(&mut self, scene: &Scene, step: u64) {
        if self.told.is_none_or(|(told, _)| told != step) {
            self.publish(scene, step, Instant::now());
        }
    }

    fn publish(&mut self, scene: &Scene, step: u64, now: Instant) {
        self.due = now + PERIOD;
        // A scene's stamps all fit ROS time: it was checked when it was compiled.
        if self.topic.wanted()
            && let Ok(clock) = stamp::to_message(scene.stamp(step))
        {
            self.topic.send(&Clock { clock });
            self.told = Some((step, now));
        }
    }
}
