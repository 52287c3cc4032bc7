//! The environment variables that decide which other nodes are found, and how services are called.

use std::env::{self, VarError};

use crate::{
    names,
    security::{self, Security, SecurityStrategy},
};

/// The highest domain whose ports fit below 65 536.
pub const MAX_DOMAIN_ID: u16 = 232;

/// The longest name of a static peer that ROS 2 takes.
const MAX_PEER_LENGTH: usize = 255;

/// Where other nodes are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reach {
    /// This host, over the loopback interface, and static peers.
    Localhost,
    /// All network interfaces, by multicast, and static peers.
    Subnet,
}

/// How requests and replies of services carry the identity by which they belong together. Client and server must agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ServiceMapping {
    /// Beside the payload, as the related sample identity of DDS-RPC: `rmw_fastrtps_cpp`.
    FastDds,
    /// In front of the payload, 16 bytes: `rmw_cyclonedds_cpp`.
    Cyclone,
}

impl ServiceMapping {
    /// The `RMW_IMPLEMENTATION` that chooses it.
    pub const fn rmw(self) -> &'static str {
        match self {
            Self::FastDds => "rmw_fastrtps_cpp",
            Self::Cyclone => "rmw_cyclonedds_cpp",
        }
    }
}

/// The middleware by which nodes find and hear each other, as `RMW_IMPLEMENTATION` names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rmw {
    /// DDS, with the service mapping of its implementation.
    Dds(ServiceMapping),
    /// Zenoh, as `rmw_zenoh_cpp` uses it; needs the feature `zenoh`.
    Zenoh,
}

/// The configuration of a Zenoh session, by the variables of `rmw_zenoh_cpp`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ZenohSettings {
    /// `ZENOH_SESSION_CONFIG_URI`: a file in place of the defaults.
    pub file: Option<String>,
    /// `ZENOH_CONFIG_OVERRIDE`: pairs `key=value` on top, values in JSON5, separated by semicolons.
    pub overrides: Option<String>,
}

/// The domain, its reach and the mapping of services, as ROS 2 reads them from the environment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Environment {
    /// `ROS_DOMAIN_ID`, 0 if unset.
    pub domain_id: u16,
    /// `ROS_LOCALHOST_ONLY` (1 wins over the other), `ROS_AUTOMATIC_DISCOVERY_RANGE`; a subnet if unset.
    pub reach: Reach,
    /// `ROS_STATIC_PEERS`: addresses or names of hosts that are told of the node without multicast. None with
    /// `ROS_LOCALHOST_ONLY=1`, as in ROS 2.
    pub static_peers: Vec<String>,
    /// `RMW_IMPLEMENTATION`; that of Fast DDS if unset.
    pub rmw: Rmw,
    /// How Zenoh is configured, where it is used.
    pub zenoh: ZenohSettings,
    /// Variables that `ROS_LOCALHOST_ONLY=1` overrides; a node that joins warns of them.
    pub overridden: Vec<&'static str>,
    /// `ROS_SECURITY_ENABLE`, `ROS_SECURITY_STRATEGY`, `ROS_SECURITY_KEYSTORE`, `ROS_SECURITY_ENCLAVE_OVERRIDE`; none if
    /// unset.
    pub security: Security,
}

/// An environment variable with a value that cannot be honored.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EnvironmentError {
    /// Not a number, or out of range.
    #[error("ROS_DOMAIN_ID is {0:?}; expected a number from 0 to {MAX_DOMAIN_ID}")]
    DomainId(String),
    /// Neither 0 nor 1.
    #[error("ROS_LOCALHOST_ONLY is {0:?}; expected 0 or 1")]
    LocalhostOnly(String),
    /// Not one of the values of ROS 2.
    #[error("ROS_AUTOMATIC_DISCOVERY_RANGE is {0:?}; expected LOCALHOST, SUBNET or SYSTEM_DEFAULT")]
    DiscoveryRange(String),
    /// `OFF`: RustDDS cannot run without discovery.
    #[error(
        "ROS_AUTOMATIC_DISCOVERY_RANGE=OFF is not supported: the DDS stack cannot run without discovery"
    )]
    DiscoveryOff,
    /// A peer that is no address or host name.
    #[error("ROS_STATIC_PEERS has {0:?}; expected addresses or host names, separated by ';'")]
    StaticPeer(String),
    /// An implementation that these nodes do not talk to.
    #[error(
        "RMW_IMPLEMENTATION is {0:?}; expected rmw_fastrtps_cpp, rmw_fastrtps_dynamic_cpp, rmw_cyclonedds_cpp or rmw_zenoh_cpp"
    )]
    RmwImplementation(String),
    /// Zenoh is asked for, and not compiled in.
    #[error(
        "RMW_IMPLEMENTATION is \"rmw_zenoh_cpp\", which needs a program built with the cargo feature zenoh"
    )]
    NoZenoh,
    /// Neither `true` nor `false`.
    #[error("ROS_SECURITY_ENABLE is {0:?}; expected true or false")]
    SecurityEnable(String),
    /// Neither `Enforce` nor `Permissive`.
    #[error("ROS_SECURITY_STRATEGY is {0:?}; expected Enforce or Permissive")]
    SecurityStrategy(String),
    /// Not the name of an enclave.
    #[error("ROS_SECURITY_ENCLAVE_OVERRIDE: {0}")]
    SecurityEnclave(names::NameError),
    /// Not Unicode.
    #[error("{name} is not valid Unicode: {value:?}")]
    NotUnicode {
        /// The variable.
        name: &'static str,
        /// Its value, lossily.
        value: String,
    },
}

impl Environment {
    /// Reads the process's environment.
    pub fn from_env() -> Result<Self, EnvironmentError> {
        Self::from_lookup(|name| match env::var(name) {
            Ok(value) => Ok(Some(value)),
            Err(VarError::NotPresent) => Ok(None),
            Err(VarError::NotUnicode(value)) => Err(EnvironmentError::NotUnicode {
                name,
                value: value.to_string_lossy().into_owned(),
            }),
        })
    }

    /// A domain on the loopback interface only.
    pub fn localhost(domain_id: u16) -> Self {
        Self {
            domain_id,
            reach: Reach::Localhost,
            static_peers: Vec::new(),
            rmw: Rmw::Dds(ServiceMapping::FastDds),
            zenoh: ZenohSettings::default(),
            overridden: Vec::new(),
            security: Security::default(),
        }
    }

    fn from_lookup(
        lookup: impl Fn(&'static str) -> Result<Option<String>, EnvironmentError>,
    ) -> Result<Self, EnvironmentError> {
        let set = |name| Ok(lookup(name)?.filter(|value| !value.is_empty()));
        let domain_id = match set("ROS_DOMAIN_ID")? {
            None => 0,
            Some(text) => text
                .parse()
                .ok()
                .filter(|id| *id <= MAX_DOMAIN_ID)
                .ok_or(EnvironmentError::DomainId(text))?,
        };
        let localhost_only = match set("ROS_LOCALHOST_ONLY")?.as_deref() {
            None | Some("0") => false,
            Some("1") => true,
            Some(other) => return Err(EnvironmentError::LocalhostOnly(other.into())),
        };
        let range = match set("ROS_AUTOMATIC_DISCOVERY_RANGE")?.as_deref() {
            None | Some("SUBNET" | "SYSTEM_DEFAULT") => Reach::Subnet,
            Some("LOCALHOST") => Reach::Localhost,
            Some("OFF") if !localhost_only => return Err(EnvironmentError::DiscoveryOff),
            Some("OFF") => Reach::Localhost,
            Some(other) => return Err(EnvironmentError::DiscoveryRange(other.into())),
        };
        let mut overridden = Vec::new();
        if localhost_only {
            for name in ["ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"] {
                if set(name)?.is_some() {
                    overridden.push(name);
                }
            }
        }
        let static_peers = match set("ROS_STATIC_PEERS")? {
            Some(list) if !localhost_only => static_peers(&list)?,
            _ => Vec::new(),
        };
        let rmw = match set("RMW_IMPLEMENTATION")?.as_deref() {
            None | Some("rmw_fastrtps_cpp" | "rmw_fastrtps_dynamic_cpp") => {
                Rmw::Dds(ServiceMapping::FastDds)
            }
            Some("rmw_cyclonedds_cpp") => Rmw::Dds(ServiceMapping::Cyclone),
            Some("rmw_zenoh_cpp") if cfg!(feature = "zenoh") => Rmw::Zenoh,
            Some("rmw_zenoh_cpp") => return Err(EnvironmentError::NoZenoh),
            Some(other) => return Err(EnvironmentError::RmwImplementation(other.into())),
        };
        let zenoh = ZenohSettings {
            file: set("ZENOH_SESSION_CONFIG_URI")?,
            overrides: set("ZENOH_CONFIG_OVERRIDE")?,
        };
        Ok(Self {
            domain_id,
            static_peers,
            rmw,
            zenoh,
            overridden,
            security: security(set)?,
            reach: if localhost_only {
                Reach::Localhost
            } else {
                range
            },
        })
    }
}

/// `rcl` takes any other value of the first two for `false` and `Permissive`: here nothing is insecure by a slip.
fn security(
    set: impl Fn(&'static str) -> Result<Option<String>, EnvironmentError>,
) -> Result<Security, EnvironmentError> {
    match set(security::ENABLE)?.as_deref() {
        None | Some("false") => return Ok(Security::default()),
        Some("true") => {}
        Some(other) => return Err(EnvironmentError::SecurityEnable(other.into())),
    }
    let strategy = match set(security::STRATEGY)?.as_deref() {
        None | Some("Permissive") => SecurityStrategy::Permissive,
        Some("Enforce") => SecurityStrategy::Enforce,
        Some(other) => return Err(EnvironmentError::SecurityStrategy(other.into())),
    };
    let enclave_override = set(security::OVERRIDE)?;
    if let Some(enclave) = &enclave_override {
        names::check_namespace(names::ENCLAVE, enclave)
            .map_err(EnvironmentError::SecurityEnclave)?;
    }
    Ok(Security {
        strategy: Some(strategy),
        keystore: set(security::KEYSTORE)?.map(Into::into),
        enclave_override,
    })
}

fn static_peers(list: &str) -> Result<Vec<String>, EnvironmentError> {
    let peers = list.split(';').filter(|peer| !peer.is_empty());
    peers
        .map(|peer| {
            let known = |byte: u8| byte.is_ascii_alphanumeric() || b"-._".contains(&byte);
            if peer.len() <= MAX_PEER_LENGTH && peer.bytes().all(known) {
                Ok(peer.into())
            } else {
                Err(EnvironmentError::StaticPeer(peer.into()))
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(variables: &[(&str, &str)]) -> Result<Environment, EnvironmentError> {
        Environment::from_lookup(|name| {
            Ok(variables
                .iter()
                .find(|(key, _)| *key == name)
                .map(|(_, value)| (*value).into()))
        })
    }

    #[test]
    fn defaults_are_those_of_ros() {
        let expected = Environment {
            domain_id: 0,
            reach: Reach::Subnet,
            static_peers: Vec::new(),
            rmw: Rmw::Dds(ServiceMapping::FastDds),
            zenoh: ZenohSettings::default(),
            overridden: Vec::new(),
            security: Security::default(),
        };
        assert_eq!(read(&[]), Ok(expected.clone()));
        assert_eq!(read(&[("ROS_DOMAIN_ID", "")]), Ok(expected));
    }

    #[test]
    fn domain_ids_are_bounded() {
        assert_eq!(read(&[("ROS_DOMAIN_ID", "232")]).unwrap().domain_id, 232);
        for bad in ["233", "-1", "x", "1.0"] {
            assert_eq!(
                read(&[("ROS_DOMAIN_ID", bad)]),
                Err(EnvironmentError::DomainId(bad.into()))
            );
        }
    }

    #[test]
    fn the_middleware_is_that_of_the_peers() {
        let rmw = |name| read(&[("RMW_IMPLEMENTATION", name)]).map(|read| read.rmw);
        let dds = |mapping| Ok(Rmw::Dds(mapping));
        assert_eq!(rmw("rmw_cyclonedds_cpp"), dds(ServiceMapping::Cyclone));
        assert_eq!(rmw("rmw_fastrtps_cpp"), dds(ServiceMapping::FastDds));
        let zenoh = if cfg!(feature = "zenoh") {
            Ok(Rmw::Zenoh)
        } else {
            Err(EnvironmentError::NoZenoh)
        };
        assert_eq!(rmw("rmw_zenoh_cpp"), zenoh);
        let other = EnvironmentError::RmwImplementation("rmw_connextdds".into());
        assert_eq!(rmw("rmw_connextdds"), Err(other));
    }

    #[test]
    fn either_variable_keeps_to_the_host() {
        let reach = |variables| read(variables).map(|environment| environment.reach);
        assert_eq!(reach(&[("ROS_LOCALHOST_ONLY", "1")]), Ok(Reach::Localhost));
        assert_eq!(
            reach(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")]),
            Ok(Reach::Localhost)
        );
        assert_eq!(
            reach(&[
                ("ROS_LOCALHOST_ONLY", "1"),
                ("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
            ]),
            Ok(Reach::Localhost)
        );
        assert_eq!(
            reach(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")]),
            Err(EnvironmentError::DiscoveryOff)
        );
        assert_eq!(
            reach(&[("ROS_LOCALHOST_ONLY", "yes")]),
            Err(EnvironmentError::LocalhostOnly("yes".into()))
        );
    }

    #[test]
    fn static_peers_are_parted_by_semicolons() {
        let peers = |list| read(&[("ROS_STATIC_PEERS", list)]).map(|read| read.static_peers);
        let expected = vec!["192.168.0.1".to_owned(), "remote.com".into()];
        assert_eq!(peers("192.168.0.1;remote.com"), Ok(expected.clone()));
        assert_eq!(peers(";192.168.0.1;;remote.com;"), Ok(expected));
        assert_eq!(peers(""), Ok(Vec::new()));
        for bad in [
            "10.0.0.1:7400",
            "10.0.0.1,10.0.0.2",
            "a b",
            "::1",
            &"a".repeat(256),
        ] {
            assert_eq!(peers(bad), Err(EnvironmentError::StaticPeer(bad.into())));
        }
    }

    #[test]
    fn localhost_only_wins_over_range_and_peers() {
        let environment = read(&[
            ("ROS_LOCALHOST_ONLY", "1"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"),
            ("ROS_STATIC_PEERS", "10.0.0.1"),
        ]);
        let expected = Environment {
            overridden: vec!["ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"],
            ..Environment::localhost(0)
        };
        assert_eq!(environment, Ok(expected));
    }

    #[test]
    fn ranges_are_those_of_ros() {
        let reach =
            |range| read(&[("ROS_AUTOMATIC_DISCOVERY_RANGE", range)]).map(|read| read.reach);
        for range in ["SUBNET", "SYSTEM_DEFAULT", ""] {
            assert_eq!(reach(range), Ok(Reach::Subnet), "{range}");
        }
        for range in ["subnet", "LOCAL"] {
            let refused = EnvironmentError::DiscoveryRange(range.into());
            assert_eq!(reach(range), Err(refused));
        }
    }

    #[test]
    fn security_is_asked_for_in_so_many_words() {
        let security = |variables: &[(&str, &str)]| read(variables).map(|read| read.security);
        let keystore = ("ROS_SECURITY_KEYSTORE", "/keys");
        let none = Ok(Security::default());
        assert_eq!(security(&[keystore]), none);
        assert_eq!(
            security(&[("ROS_SECURITY_ENABLE", "false"), keystore]),
            none
        );
        let enable = ("ROS_SECURITY_ENABLE", "true");
        let expected = Security {
            strategy: Some(SecurityStrategy::Permissive),
            keystore: Some("/keys".into()),
            enclave_override: None,
        };
        assert_eq!(security(&[enable, keystore]), Ok(expected.clone()));
        let enforced = Security {
            strategy: Some(SecurityStrategy::Enforce),
            enclave_override: Some("/a".into()),
            ..expected
        };
        let enforce = ("ROS_SECURITY_STRATEGY", "Enforce");
        let other = ("ROS_SECURITY_ENCLAVE_OVERRIDE", "/a");
        assert_eq!(security(&[enable, enforce, keystore, other]), Ok(enforced));
        for value in ["1", "True", "yes"] {
            let refused = EnvironmentError::SecurityEnable(value.into());
            assert_eq!(security(&[("ROS_SECURITY_ENABLE", value)]), Err(refused));
        }
        let refused = EnvironmentError::SecurityStrategy("enforce".into());
        let strategy = ("ROS_SECURITY_STRATEGY", "enforce");
        assert_eq!(security(&[enable, strategy]), Err(refused));
        for enclave in ["a", "/a/", "/../x"] {
            let other = ("ROS_SECURITY_ENCLAVE_OVERRIDE", enclave);
            let error = security(&[enable, other]).unwrap_err().to_string();
            let expected = format!("ROS_SECURITY_ENCLAVE_OVERRIDE: enclave {enclave:?}");
            assert!(error.starts_with(&expected), "{error}");
        }
    }
}
