//! Quality of service: one table for all topics.

use std::time::Duration;

/// How long [`publish`](super::Publisher::publish) may wait for slow reliable subscriptions.
const MAX_WAIT: Duration = Duration::from_millis(100);

/// The fewest samples a reliable publisher may have unacknowledged before it waits, whatever its depth.
const MIN_WINDOW: usize = 512;

/// The same for a latched one. RustDDS retains as many while nobody listens, and gives them to whoever comes.
const MIN_LATCHED_WINDOW: usize = 16;

/// The most: beyond it RustDDS forgets what it has to repair.
const MAX_WINDOW: usize = 8192;

/// How samples of a topic are delivered.
///
/// | Preset | Publisher offers | Subscription requests | For |
/// | --- | --- | --- | --- |
/// | [`latched`](Self::latched) | reliable, transient local | reliable, transient local | what late joiners need: scenes, plans, controls |
/// | [`reliable`](Self::reliable) | reliable, transient local | reliable, volatile | streams that must be complete: states, odometry, tf |
/// | [`volatile`](Self::volatile) | reliable, volatile | reliable, volatile | streams of which the past must not be heard: `/clock` |
/// | [`sensor`](Self::sensor) | best effort, volatile | best effort, volatile | streams of which the latest matters |
///
/// Publishers of `latched` and `reliable` are durable so that they match subscriptions of every kind, and that none
/// misses the first sample: subscriptions of this crate get everything from the publisher's match on, and so do durable
/// ones of other makes. (A volatile one of another make gets what is sent after its own match, which no publisher can
/// see.) `latched` subscriptions match durable publishers only, `reliable` and `volatile` ones every reliable publisher,
/// `sensor` ones every publisher.
///
/// The depth of a publisher is how many samples a late joiner gets at least: RustDDS trims only every few seconds, so
/// that it may get more, oldest first. The depth of a subscription is how many samples wait to be taken; further ones
/// push out the oldest, which [`lost`](super::RawSubscription::lost) counts.
///
/// A reliable publisher has a window: 512 samples (16 if latched) or twice its depth, whichever is more, but at most 8192
/// may be unacknowledged. A subscription that is stopped, hangs or was killed fills it. Then the publisher waits once for
/// its participant, and overwrites the older half of the window as ROS 2 publishers do: all others go on receiving
/// everything, and the one that is back gets the later half, and counts what it has lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Qos {
    pub(super) reliable: bool,
    pub(super) latched: bool,
    /// Whether a reliable publisher keeps nothing for late joiners.
    pub(super) volatile: bool,
    depth: usize,
    max_wait: Duration,
}

impl Qos {
    /// The last `depth` samples, also for subscriptions that come later.
    pub const fn latched(depth: usize) -> Self {
        Self {
            latched: true,
            ..Self::reliable(depth)
        }
    }

    /// Every sample, as long as subscriptions keep up.
    pub const fn reliable(depth: usize) -> Self {
        Self {
            reliable: true,
            latched: false,
            volatile: false,
            depth,
            max_wait: MAX_WAIT,
        }
    }

    /// Every sample from the match on and none from before it, as long as subscriptions keep up.
    pub const fn volatile(depth: usize) -> Self {
        Self {
            volatile: true,
            ..Self::reliable(depth)
        }
    }

    /// Samples may be lost, and nothing ever waits.
    pub const fn sensor(depth: usize) -> Self {
        Self {
            reliable: false,
            ..Self::reliable(depth)
        }
    }

    /// Changes how long [`publish`](super::Publisher::publish) may wait: 100 ms unless changed.
    #[must_use]
    pub const fn max_wait(self, max_wait: Duration) -> Self {
        Self { max_wait, ..self }
    }

    pub(super) fn depth(&self) -> usize {
        self.depth.max(1)
    }

    pub(super) fn publish_limit(&self) -> Duration {
        if self.reliable {
            self.max_wait
        } else {
            Duration::ZERO
        }
    }

    /// How many samples of a publisher may be unacknowledged. Half of them are the depth at least, so that a
    /// subscription that has not kept up still gets as many.
    pub(super) fn window(&self) -> usize {
        let least = if self.latched {
            MIN_LATCHED_WINDOW
        } else {
            MIN_WINDOW
        };
        self.depth.saturating_mul(2).clamp(least, MAX_WINDOW)
    }
}
