use serde::{Deserialize, Serialize};

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
#[serde(rename_all = "snake_case", from = "Policy")]
pub enum Reliability {
    /// Never.
    BestEffort,
    /// Until they are acknowledged.
    #[default]
    Reliable,
}

/// Whether late joiners get earlier samples; the stronger policy is greater.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", from = "Policy")]
pub enum Durability {
    /// No.
    #[default]
    Volatile,
    /// As long as the publisher lives.
    TransientLocal,
}

/// Which samples are kept; the one that may keep more is greater.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", from = "Policy")]
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
            liveliness: serde_yaml_ng::Value::from("automatic"),
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
    liveliness: serde_yaml_ng::Value,
    liveliness_lease_duration: Duration,
    avoid_ros_namespace_conventions: bool,
}

/// A policy by name, or by its number in `rmw/types.h` up to metadata version 8.
#[derive(Deserialize)]
#[serde(untagged)]
enum Policy {
    Name(String),
    Number(i64),
}

impl Policy {
    fn is(&self, name: &str, number: i64) -> bool {
        match self {
            Self::Name(found) => found == name,
            Self::Number(found) => *found == number,
        }
    }
}

impl From<Policy> for Reliability {
    fn from(policy: Policy) -> Self {
        match policy.is("best_effort", 2) {
            true => Self::BestEffort,
            false => Self::Reliable,
        }
    }
}

impl From<Policy> for Durability {
    fn from(policy: Policy) -> Self {
        match policy.is("transient_local", 1) {
            true => Self::TransientLocal,
            false => Self::Volatile,
        }
    }
}

impl From<Policy> for History {
    fn from(policy: Policy) -> Self {
        match policy {
            policy if policy.is("keep_all", 2) => Self::KeepAll,
            policy if policy.is("keep_last", 1) => Self::KeepLast,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip() {
        for reliability in [Reliability::Reliable, Reliability::BestEffort] {
            for durability in [Durability::Volatile, Durability::TransientLocal] {
                for history in [History::KeepLast, History::KeepAll, History::Unknown] {
                    let qos = Qos {
                        reliability,
                        durability,
                        history,
                        depth: 7,
                    };
                    assert_eq!(Qos::from_yaml(&qos.to_yaml().unwrap()).unwrap(), qos);
                }
            }
        }
    }

    #[test]
    fn text_is_that_of_jazzy() {
        let expected = "\
- history: keep_last
  depth: 10
  reliability: reliable
  durability: volatile
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
";
        assert_eq!(Qos::default().to_yaml().unwrap(), expected);
    }

    #[test]
    fn what_discovery_does_not_tell_is_unknown() {
        let qos = Qos {
            history: History::Unknown,
            depth: 0,
            ..Qos::default()
        };
        let text = qos.to_yaml().unwrap();
        assert!(
            text.starts_with("- history: unknown\n  depth: 0\n"),
            "{text}"
        );
        assert_eq!(Qos::from_yaml(&text).unwrap(), qos);
    }

    #[test]
    fn late_joiners_are_taken_to_get_what_a_publisher_keeps() {
        let assumed = |history, depth| {
            Qos {
                history,
                depth,
                ..Qos::default()
            }
            .assumed_depth()
        };
        assert_eq!(assumed(History::KeepLast, 0), 1);
        assert_eq!(assumed(History::KeepLast, 7), 7);
        assert_eq!(assumed(History::KeepAll, 0), u32::MAX);
        assert_eq!(assumed(History::Unknown, 0), Qos::default().depth);
    }

    #[test]
    fn publishers_keep_together_what_each_of_them_keeps() {
        use Durability::{TransientLocal, Volatile};
        use History::{KeepAll, KeepLast, Unknown};
        let profile = |durability, history, depth| Qos {
            durability,
            history,
            depth,
            ..Qos::default()
        };
        let latched = |history, depth| profile(TransientLocal, history, depth);
        for (profiles, together) in [
            (vec![latched(KeepLast, 1); 15], latched(KeepLast, 15)),
            (
                vec![latched(KeepLast, 2), latched(KeepLast, 5)],
                latched(KeepLast, 7),
            ),
            (
                vec![latched(KeepLast, u32::MAX), latched(KeepLast, 5)],
                latched(KeepLast, u32::MAX),
            ),
            (
                vec![profile(Volatile, KeepAll, 100), latched(KeepLast, 5)],
                latched(KeepLast, 5),
            ),
            (
                vec![latched(KeepLast, 5), latched(Unknown, 0)],
                latched(Unknown, 5),
            ),
            (
                vec![latched(KeepAll, 0), latched(Unknown, 0)],
                latched(KeepAll, 0),
            ),
        ] {
            let texts = profiles.iter().map(|profile| profile.to_yaml().unwrap());
            let text: String = texts.collect();
            assert_eq!(Qos::from_yaml(&text).unwrap(), together);
            let reversed: String = profiles
                .iter()
                .rev()
                .map(|profile| profile.to_yaml().unwrap())
                .collect();
            assert_eq!(Qos::from_yaml(&reversed).unwrap(), together);
            // Further files tell of the same publishers.
            assert_eq!(together.strongest(together), together);
        }
    }

    #[test]
    fn reads_what_humble_records() {
        let text = "- {history: 3, depth: 0, reliability: 2, durability: 1, deadline: {sec: 9223372036, nsec: 854775807}, \
                    lifespan: {sec: 9223372036, nsec: 854775807}, liveliness: 1, \
                    liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}, avoid_ros_namespace_conventions: false}";
        let expected = Qos {
            reliability: Reliability::BestEffort,
            durability: Durability::TransientLocal,
            history: History::Unknown,
            depth: 0,
        };
        assert_eq!(Qos::from_yaml(text).unwrap(), expected);
        assert_eq!(Qos::from_yaml("").unwrap(), Qos::default());
        assert_eq!(Qos::from_yaml("[]").unwrap(), Qos::default());
        assert!(Qos::from_yaml("history: keep_last").is_err());
    }
}
