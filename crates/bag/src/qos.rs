use serde::{Deserialize, Serialize};
use serde_yaml_ng::Value;

use crate::yaml;

/// Quality of service of a publisher, or of all publishers of a topic together, as far as it decides what a late or slow
/// reader gets.
///
/// A reliability or durability that is unknown or a system's default is read as the default of ROS 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Whether lost samples are sent again until they are acknowledged.
    pub reliable: bool,
    /// Whether late joiners get earlier samples, as long as the publisher lives: `transient_local`, else `volatile`.
    pub durable: bool,
    /// Which samples are kept for that.
    pub history: History,
    /// Number of samples kept with [`History::KeepLast`], by all publishers together; 0 where it is unknown.
    pub depth: u32,
}

/// Which samples are kept; the one that may keep more is greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum History {
    /// The latest, as many as the depth says.
    KeepLast,
    /// Discovery does not tell.
    Unknown,
    /// All.
    KeepAll,
}

impl History {
    /// Its name in profiles.
    pub fn name(self) -> &'static str {
        match self {
            Self::KeepLast => "keep_last",
            Self::Unknown => "unknown",
            Self::KeepAll => "keep_all",
        }
    }
}

impl Default for Qos {
    fn default() -> Self {
        Self {
            reliable: true,
            durable: false,
            history: History::KeepLast,
            depth: 10,
        }
    }
}

impl Qos {
    /// Name of the reliability in profiles.
    pub fn reliability(&self) -> &'static str {
        if self.reliable {
            "reliable"
        } else {
            "best_effort"
        }
    }

    /// Name of the durability in profiles.
    pub fn durability(&self) -> &'static str {
        if self.durable {
            "transient_local"
        } else {
            "volatile"
        }
    }

    /// How many samples of one publisher late joiners are taken to get: the depth, or that of ROS 2's default where it is
    /// unknown.
    pub fn assumed_depth(&self) -> u32 {
        match self.history {
            History::Unknown => Self::default().depth,
            History::KeepLast => self.depth.max(1),
            History::KeepAll => u32::MAX,
        }
    }

    /// The profile as rosbag2 writes it into `metadata.yaml`.
    pub(crate) fn profile(&self) -> Profile {
        Profile {
            history: self.history.name().into(),
            depth: self.depth,
            reliability: self.reliability().into(),
            durability: self.durability().into(),
            deadline: INFINITE,
            lifespan: INFINITE,
            liveliness: "automatic".into(),
            liveliness_lease_duration: INFINITE,
            avoid_ros_namespace_conventions: false,
        }
    }

    /// The text that rosbag2 writes into an MCAP channel's metadata.
    pub(crate) fn to_yaml(self) -> Result<String, serde_yaml_ng::Error> {
        serde_yaml_ng::to_string(&[self.profile()])
    }

    /// Reads the profiles of an MCAP channel's metadata, of rosbag2 metadata version 4 to 9: one for each publisher, which
    /// together suit every subscriber that any of them suited, and keep what all of them kept.
    pub(crate) fn from_yaml(text: &str) -> Result<Self, serde_yaml_ng::Error> {
        if text.trim().is_empty() {
            return Ok(Self::default());
        }
        let profiles: Vec<Profile> = yaml::read(text)?;
        let profiles = profiles.iter().map(Self::from);
        let together = profiles.reduce(|one, other| one.combine(other, u32::saturating_add));
        Ok(together.unwrap_or_default())
    }

    /// What a topic offers of which two files tell: each policy of the one that offers more.
    pub(crate) fn strongest(self, other: Self) -> Self {
        self.combine(other, u32::max)
    }

    /// The history is that of those that keep samples for late joiners, if there are any.
    fn combine(self, other: Self, depths: impl Fn(u32, u32) -> u32) -> Self {
        let (history, depth) = match (self.durable, other.durable) {
            (true, false) => (self.history, self.depth),
            (false, true) => (other.history, other.depth),
            _ => (
                self.history.max(other.history),
                depths(self.depth, other.depth),
            ),
        };
        Self {
            reliable: self.reliable || other.reliable,
            durable: self.durable || other.durable,
            history,
            depth,
        }
    }
}

/// A profile, whose policies are names, or numbers of `rmw/types.h` up to metadata version 8.
#[derive(Serialize, Deserialize)]
pub(crate) struct Profile {
    history: Value,
    depth: u32,
    reliability: Value,
    durability: Value,
    deadline: Duration,
    lifespan: Duration,
    liveliness: Value,
    liveliness_lease_duration: Duration,
    avoid_ros_namespace_conventions: bool,
}

impl From<&Profile> for Qos {
    fn from(profile: &Profile) -> Self {
        let is = |policy: &Value, name: &str, number: i64| {
            policy.as_str() == Some(name) || policy.as_i64() == Some(number)
        };
        Self {
            reliable: !is(&profile.reliability, "best_effort", 2),
            durable: is(&profile.durability, "transient_local", 1),
            history: match &profile.history {
                history if is(history, "keep_all", 2) => History::KeepAll,
                history if is(history, "keep_last", 1) => History::KeepLast,
                _ => History::Unknown,
            },
            depth: profile.depth,
        }
    }
}

#[derive(Serialize, Deserialize)]
struct Duration {
    sec: u64,
    nsec: u64,
}

/// `RMW_DURATION_INFINITE`: [`i64::MAX`] nanoseconds.
const INFINITE: Duration = Duration {
    sec: 9_223_372_036,
    nsec: 854_775_807,
};
