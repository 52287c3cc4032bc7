use serde::{Deserialize, Serialize};
use serde_yaml_ng::Value;

use crate::yaml;

/// Quality of service of a publisher, or of all publishers of a topic together, as far as it decides what a late or slow
/// reader gets.
///
/// A reliability or durability that is unknown or a system's default is read as the default of ROS 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Whether lost samples are sent again.
    pub reliability: Reliability,
    /// Whether late joiners get earlier samples.
    pub durability: Durability,
    /// Which samples are kept for that.
    pub history: History,
    /// Number of samples kept with [`History::KeepLast`], by all publishers together; 0 where it is unknown.
    pub depth: u32,
}

/// Whether lost samples are sent again; the stronger policy is greater.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", from = "Value")]
pub enum Reliability {
    /// Never.
    BestEffort,
    /// Until they are acknowledged.
    #[default]
    Reliable,
}

/// Whether late joiners get earlier samples; the stronger policy is greater.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", from = "Value")]
pub enum Durability {
    /// No.
    #[default]
    Volatile,
    /// As long as the publisher lives.
    TransientLocal,
}

/// Which samples are kept; the one that may keep more is greater.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", from = "Value")]
pub enum History {
    /// The latest, as many as the depth says.
    #[default]
    KeepLast,
    /// Discovery does not tell.
    Unknown,
    /// All.
    KeepAll,
}

impl Default for Qos {
    fn default() -> Self {
        Self {
            reliability: Reliability::default(),
            durability: Durability::default(),
            history: History::default(),
            depth: 10,
        }
    }
}

impl Qos {
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
            history: self.history,
            depth: self.depth,
            reliability: self.reliability,
            durability: self.durability,
            deadline: INFINITE,
            lifespan: INFINITE,
            liveliness: Value::from("automatic"),
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
        let profiles = profiles.into_iter().map(Self::from);
        let together = profiles.reduce(|one, other| one.combine(other, u32::saturating_add));
        Ok(together.unwrap_or_default())
    }

    /// What a topic offers of which two files tell: each policy of the one that offers more.
    pub(crate) fn strongest(self, other: Self) -> Self {
        self.combine(other, u32::max)
    }

    /// The history is that of those that keep samples for late joiners, if there are any.
    fn combine(self, other: Self, depths: impl Fn(u32, u32) -> u32) -> Self {
        let (history, depth) = match (self.durability, other.durability) {
            (Durability::TransientLocal, Durability::Volatile) => (self.history, self.depth),
            (Durability::Volatile, Durability::TransientLocal) => (other.history, other.depth),
            _ => (
                self.history.max(other.history),
                depths(self.depth, other.depth),
            ),
        };
        Self {
            reliability: self.reliability.max(other.reliability),
            durability: self.durability.max(other.durability),
            history,
            depth,
        }
    }
}

impl From<Profile> for Qos {
    fn from(profile: Profile) -> Self {
        Self {
            reliability: profile.reliability,
            durability: profile.durability,
            history: profile.history,
            depth: profile.depth,
        }
    }
}

#[derive(Serialize, Deserialize)]
pub(crate) struct Profile {
    history: History,
    depth: u32,
    reliability: Reliability,
    durability: Durability,
    deadline: Duration,
    lifespan: Duration,
    liveliness: Value,
    liveliness_lease_duration: Duration,
    avoid_ros_namespace_conventions: bool,
}

/// Whether a policy is the one of this name, or of this number in `rmw/types.h` up to metadata version 8.
fn is(policy: &Value, name: &str, number: i64) -> bool {
    policy.as_str() == Some(name) || policy.as_i64() == Some(number)
}

impl From<Value> for Reliability {
    fn from(policy: Value) -> Self {
        match is(&policy, "best_effort", 2) {
            true => Self::BestEffort,
            false => Self::Reliable,
        }
    }
}

impl From<Value> for Durability {
    fn from(policy: Value) -> Self {
        match is(&policy, "transient_local", 1) {
            true => Self::TransientLocal,
            false => Self::Volatile,
        }
    }
}

impl From<Value> for History {
    fn from(policy: Value) -> Self {
        match policy {
            policy if is(&policy, "keep_all", 2) => Self::KeepAll,
            policy if is(&policy, "keep_last", 1) => Self::KeepLast,
            _ => Self::Unknown,
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
