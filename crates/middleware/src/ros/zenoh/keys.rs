//! Key expressions of topics and services, and the liveliness tokens that announce nodes and endpoints.

use std::fmt::Display;

use crate::names;

/// What all tokens begin with.
const SPACE: &str = "@ros2_lv";

/// The hash of a type that has none, and the chunk that takes any.
const NO_HASH: &str = "TypeHashNotSupported";
const ANY_HASH: &str = "*";

/// The depth that `rmw_zenoh_cpp` does not write.
const DEFAULT_DEPTH: usize = 42;

/// A node as tokens name it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Node {
    pub(super) domain_id: u16,
    pub(super) session: String,
    pub(super) id: u64,
    /// Absolute; `/` is the root.
    pub(super) namespace: String,
    pub(super) name: String,
}

/// On which side of a topic or a service an endpoint is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Publisher,
    Subscription,
    Server,
    Client,
}

/// The quality of service that tokens carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Offer {
    pub(super) reliable: bool,
    pub(super) durable: bool,
    pub(super) depth: usize,
}

/// An endpoint as tokens describe it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Endpoint {
    pub(super) kind: Kind,
    /// The absolute name of the topic or the service.
    pub(super) topic: String,
    /// `package::msg::dds_::Type_`
    pub(super) type_name: String,
    /// `RIHS01_…`, if it is known.
    pub(super) hash: Option<String>,
    pub(super) offer: Offer,
}

/// What a token says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Entity {
    pub(super) node: Node,
    /// `None` for the node itself.
    pub(super) endpoint: Option<Endpoint>,
}

impl Kind {
    const ALL: [(Self, &str); 4] = [
        (Self::Publisher, "MP"),
        (Self::Subscription, "MS"),
        (Self::Server, "SS"),
        (Self::Client, "SC"),
    ];

    /// What it works with.
    pub(super) fn counterpart(self) -> Self {
        match self {
            Self::Publisher => Self::Subscription,
            Self::Subscription => Self::Publisher,
            Self::Server => Self::Client,
            Self::Client => Self::Server,
        }
    }

    fn code(self) -> &'static str {
        let code = Self::ALL.iter().find(|(kind, _)| *kind == self);
        code.map_or("", |(_, code)| code)
    }

    fn read(code: &str) -> Option<Self> {
        let kind = Self::ALL.iter().find(|(_, known)| *known == code);
        kind.map(|(kind, _)| *kind)
    }
}

impl Node {
    pub(super) fn fully_qualified_name(&self) -> String {
        names::join(&self.namespace, &self.name)
    }

    pub(super) fn token(&self) -> String {
        self.entity(self.id, "NN")
    }

    fn entity(&self, id: impl Display, kind: &str) -> String {
        let Self {
            domain_id,
            session,
            id: node,
            ..
        } = self;
        let (namespace, name) = (mangled(&self.namespace), mangled(&self.name));
        format!("{SPACE}/{domain_id}/{session}/{node}/{id}/{kind}/%/{namespace}/{name}")
    }
}

impl Endpoint {
    pub(super) fn token(&self, node: &Node, id: u64) -> String {
        let entity = node.entity(id, self.kind.code());
        let (topic, type_name) = (mangled(&self.topic), mangled(&self.type_name));
        let hash = self.hash.as_deref().unwrap_or(NO_HASH);
        format!("{entity}/{topic}/{type_name}/{hash}/{}", self.offer.code())
    }

    /// Where its samples or requests go.
    pub(super) fn key(&self, domain_id: u16) -> String {
        let topic = self.topic.trim_matches('/');
        let unknown = if self.kind == Kind::Subscription {
            ANY_HASH
        } else {
            NO_HASH
        };
        let hash = self.hash.as_deref().unwrap_or(unknown);
        format!("{domain_id}/{topic}/{}/{hash}", self.type_name)
    }

    /// Whether they are on the two sides of one topic or service.
    pub(super) fn faces(&self, other: &Self) -> bool {
        self.kind == other.kind.counterpart() && self.topic == other.topic
    }

    /// Whether messages of one are understood by the other.
    pub(super) fn understands(&self, other: &Self) -> bool {
        let hashes = self.hash.as_ref().zip(other.hash.as_ref());
        self.type_name == other.type_name && hashes.is_none_or(|(own, other)| own == other)
    }
}

impl Offer {
    /// Reliability, durability, history, and three durations: empty where it is the default.
    fn code(self) -> String {
        let reliability = if self.reliable { "" } else { "2" };
        let durability = if self.durable { "1" } else { "" };
        let depth = match self.depth {
            DEFAULT_DEPTH => String::new(),
            depth => depth.to_string(),
        };
        format!("{reliability}:{durability}:,{depth}:,:,:,,")
    }

    fn read(code: &str) -> Option<Self> {
        let mut parts = code.split(':');
        let (reliability, durability) = (parts.next()?, parts.next()?);
        let (_, depth) = parts.next()?.split_once(',')?;
        Some(Self {
            reliable: reliability != "2",
            durable: durability == "1",
            depth: if depth.is_empty() {
                DEFAULT_DEPTH
            } else {
                depth.parse().ok()?
            },
        })
    }
}

impl Entity {
    /// Reads a token; `None` if it is none of ROS 2.
    pub(super) fn read(token: &str) -> Option<Self> {
        let mut chunks = token.split('/');
        if chunks.next()? != SPACE {
            return None;
        }
        let domain_id = chunks.next()?.parse().ok()?;
        let session = chunks.next()?.to_owned();
        let id = chunks.next()?.parse().ok()?;
        let (_, kind, _) = (chunks.next()?, chunks.next()?, chunks.next()?);
        let (namespace, name) = (named(chunks.next()?), named(chunks.next()?));
        let node = Node {
            domain_id,
            session,
            id,
            namespace,
            name,
        };
        if kind == "NN" {
            return Some(Self {
                node,
                endpoint: None,
            });
        }
        let endpoint = Endpoint {
            kind: Kind::read(kind)?,
            topic: named(chunks.next()?),
            type_name: named(chunks.next()?),
            hash: Some(chunks.next()?.to_owned()).filter(|hash| hash.starts_with("RIHS")),
            offer: Offer::read(chunks.next()?)?,
        };
        Some(Self {
            node,
            endpoint: Some(endpoint),
        })
    }
}

/// All tokens of a domain.
pub(super) fn tokens(domain_id: u16) -> String {
    format!("{SPACE}/{domain_id}/**")
}

fn mangled(name: &str) -> String {
    name.replace('/', "%")
}

fn named(mangled: &str) -> String {
    mangled.replace('%', "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node() -> Node {
        Node {
            domain_id: 2,
            session: "aac3178e146ba6f1fc6e6a4085e77f21".into(),
            id: 0,
            namespace: "/".into(),
            name: "talker".into(),
        }
    }

    fn endpoint() -> Endpoint {
        Endpoint {
            kind: Kind::Publisher,
            topic: "/chatter".into(),
            type_name: "std_msgs::msg::dds_::String_".into(),
            hash: Some(
                "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18".into(),
            ),
            offer: Offer {
                reliable: true,
                durable: false,
                depth: 7,
            },
        }
    }

    /// The examples of rmw_zenoh's design document.
    #[test]
    fn tokens_are_those_of_rmw_zenoh() {
        assert_eq!(
            node().token(),
            "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/talker"
        );
        assert_eq!(
            endpoint().token(&node(), 11),
            "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/11/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/\
             RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18/::,7:,:,:,,"
        );
        assert_eq!(
            endpoint().key(2),
            "2/chatter/std_msgs::msg::dds_::String_/RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
        );
    }

    #[test]
    fn tokens_are_read_back() {
        for kind in Kind::ALL.map(|(kind, _)| kind) {
            for (reliable, durable, depth) in [(true, true, 42), (false, false, 1)] {
                let offer = Offer {
                    reliable,
                    durable,
                    depth,
                };
                let endpoint = Endpoint {
                    kind,
                    offer,
                    topic: "/a/b".into(),
                    ..endpoint()
                };
                let node = Node {
                    namespace: "/one/two".into(),
                    ..node()
                };
                let read = Entity::read(&endpoint.token(&node, 3)).unwrap();
                assert_eq!(read.endpoint, Some(endpoint));
                assert_eq!(read.node, node);
                assert_eq!(node.fully_qualified_name(), "/one/two/talker");
            }
        }
        let read = Entity::read(&node().token()).unwrap();
        assert_eq!(
            read,
            Entity {
                node: node(),
                endpoint: None
            }
        );
    }

    #[test]
    fn what_is_no_token_is_none() {
        let token = endpoint().token(&node(), 3);
        let chunks: Vec<_> = token.split('/').collect();
        for count in 0..chunks.len() {
            assert_eq!(Entity::read(&chunks[..count].join("/")), None, "{count}");
        }
        for bad in [
            "",
            "x",
            "@ros2_lv/x/y/0/0/NN/%/%/talker",
            "@ros2_lv/0/y/0/0/XX/%/%/t/%c/T/h/::,:,:,:,,",
        ] {
            assert_eq!(Entity::read(bad), None, "{bad}");
        }
    }

    #[test]
    fn a_subscription_without_a_hash_takes_any() {
        let unknown = Endpoint {
            kind: Kind::Subscription,
            hash: None,
            ..endpoint()
        };
        assert!(unknown.key(0).ends_with("/*"));
        assert!(unknown.faces(&endpoint()) && unknown.understands(&endpoint()));
        let other = Endpoint {
            hash: Some("RIHS01_00".into()),
            ..endpoint()
        };
        assert!(!endpoint().faces(&other) && !endpoint().understands(&other));
    }
}
