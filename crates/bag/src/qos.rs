use serde::{Deserialize, Serialize};

use crate::yaml;

/// Quality of service of a publisher, as far as it decides what a late or slow reader gets.
///
/// Policies that are unknown or a system's default are read as the default of ROS 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Whether lost samples are sent again.
    pub reliability: Reliability,
    /// Whether late joiners get earlier samples.
    pub durability: Durability,
    /// Which samples are kept for that.
    pub history: History,
    /// Number of samples kept with [`History::KeepLast`]; 0 where it is unknown.
    pub depth: u32,
}

/// Whether lost samples are sent again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reliability {
    /// Until they are acknowledged.
    #[default]
    Reliable,
    /// Never.
    BestEffort,
}

/// Whether late joiners get earlier samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Durability {
    /// No.
    #[default]
    Volatile,
    /// As long as the publisher lives.
    TransientLocal,
}

/// Which samples are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum History {
    /// The latest, as many as the depth says.
    #[default]
    KeepLast,
    /// All.
    KeepAll,
    /// Discovery does not tell. It is written so, and read as the default of ROS 2.
    Unknown,
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
    /// How many samples late joiners are taken to get: the depth, or that of ROS 2's default where it is unknown.
    pub fn assumed_depth(&self) -> u32 {
        match self.history {
            History::Unknown => Self::default().depth,
            History::KeepLast | History::KeepAll => self.depth.max(1),
        }
    }

    /// The profile as rosbag2 writes it into `metadata.yaml`.
    pub(crate) fn profile(&self) -> Profile {
        let name = |name: &str| Policy::Name(name.to_owned());
        Profile {
            history: name(match self.history {
                History::KeepLast => "keep_last",
                History::KeepAll => "keep_all",
                History::Unknown => "unknown",
            }),
            depth: self.depth,
            reliability: name(match self.reliability {
                Reliability::Reliable => "reliable",
                Reliability::BestEffort => "best_effort",
            }),
            durability: name(match self.durability {
                Durability::Volatile => "volatile",
                Durability::TransientLocal => "transient_local",
            }),
            deadline: INFINITE,
            lifespan: INFINITE,
            liveliness: name("automatic"),
            liveliness_lease_duration: INFINITE,
            avoid_ros_namespace_conventions: false,
        }
    }

    /// The text that rosbag2 writes into an MCAP channel's metadata.
    pub(crate) fn to_yaml(self) -> Result<String, serde_yaml_ng::Error> {
        serde_yaml_ng::to_string(&[self.profile()])
    }

    /// Reads the profiles of an MCAP channel's metadata, of rosbag2 metadata version 4 to 9: one for each publisher, of
    /// which the strongest suits every subscriber that any of them suited.
    pub(crate) fn from_yaml(text: &str) -> Result<Self, serde_yaml_ng::Error> {
        if text.trim().is_empty() {
            return Ok(Self::default());
        }
        let profiles: Vec<Profile> = yaml::read(text)?;
        let profiles = profiles.iter().map(Self::from_profile);
        Ok(profiles.reduce(Self::strongest).unwrap_or_default())
    }

    /// Each policy of the one that offers more.
    pub(crate) fn strongest(self, other: Self) -> Self {
        let any = |found: fn(&Self) -> bool| found(&self) || found(&other);
        Self {
            reliability: if any(|qos| qos.reliability == Reliability::Reliable) {
                Reliability::Reliable
            } else {
                Reliability::BestEffort
            },
            durability: if any(|qos| qos.durability == Durability::TransientLocal) {
                Durability::TransientLocal
            } else {
                Durability::Volatile
            },
            history: if any(|qos| qos.history == History::KeepAll) {
                History::KeepAll
            } else {
                History::KeepLast
            },
            depth: self.depth.max(other.depth),
        }
    }

    fn from_profile(profile: &Profile) -> Self {
        let reliability = if profile.reliability.is("best_effort", 2) {
            Reliability::BestEffort
        } else {
            Reliability::Reliable
        };
        let durability = if profile.durability.is("transient_local", 1) {
            Durability::TransientLocal
        } else {
            Durability::Volatile
        };
        let (history, depth) = if profile.history.is("keep_all", 2) {
            (History::KeepAll, profile.depth)
        } else if profile.history.is("keep_last", 1) {
            (History::KeepLast, profile.depth)
        } else {
            // DDS discovery does not tell a publisher's history: a recorder writes "unknown" and a depth of 0.
            (History::default(), Self::default().depth)
        };
        Self {
            reliability,
            durability,
            history,
            depth,
        }
    }
}

#[derive(Serialize, Deserialize)]
pub(crate) struct Profile {
    history: Policy,
    depth: u32,
    reliability: Policy,
    durability: Policy,
    deadline: Duration,
    lifespan: Duration,
    liveliness: Policy,
    liveliness_lease_duration: Duration,
    avoid_ros_namespace_conventions: bool,
}

/// A policy by name, or by its number in `rmw/types.h` up to metadata version 8.
#[derive(Serialize, Deserialize)]
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
                for history in [History::KeepLast, History::KeepAll] {
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
        assert_eq!(Qos::from_yaml(&text).unwrap(), Qos::default());
        assert_eq!(qos.assumed_depth(), Qos::default().depth);
        assert_eq!(
            Qos {
                depth: 0,
                ..Qos::default()
            }
            .assumed_depth(),
            1
        );
    }

    #[test]
    fn reads_what_humble_records() {
        let text = "- {history: 3, depth: 0, reliability: 2, durability: 1, deadline: {sec: 9223372036, nsec: 854775807}, \
                    lifespan: {sec: 9223372036, nsec: 854775807}, liveliness: 1, \
                    liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}, avoid_ros_namespace_conventions: false}";
        let expected = Qos {
            reliability: Reliability::BestEffort,
            durability: Durability::TransientLocal,
            ..Qos::default()
        };
        assert_eq!(Qos::from_yaml(text).unwrap(), expected);
        assert_eq!(Qos::from_yaml("").unwrap(), Qos::default());
        assert_eq!(Qos::from_yaml("[]").unwrap(), Qos::default());
        assert!(Qos::from_yaml("history: keep_last").is_err());
    }
}
