//! Nodes that cannot meet those of other tests: each test process has a router of its own.

use std::{
    process,
    sync::{
        OnceLock,
        atomic::{AtomicU16, Ordering},
    },
};

use ::zenoh::{Config, Session, Wait};
use lgvi_middleware::{Environment, NodeArgs, Rmw, ZenohSettings, ros::RosNode};

/// A router on the loopback interface, and where it listens.
pub struct Router {
    _session: Session,
    pub endpoint: String,
}

impl Router {
    pub fn start(settings: &[(&str, &str)]) -> Self {
        let mut config = Config::default();
        let own = [
            ("mode", "\"router\""),
            ("listen/endpoints", "[\"tcp/127.0.0.1:0\"]"),
            ("scouting/multicast/enabled", "false"),
        ];
        for (key, value) in own.iter().chain(settings) {
            config.insert_json5(key, value).unwrap();
        }
        let session = ::zenoh::open(config).wait().unwrap();
        let locators = session.info().locators().wait();
        let endpoint = locators.first().expect("a place to listen at").to_string();
        Self {
            _session: session,
            endpoint,
        }
    }

    /// Nodes that know this router only.
    pub fn environment(&self, domain_id: u16) -> Environment {
        connected(domain_id, &self.endpoint, "")
    }
}

pub fn connected(domain_id: u16, endpoint: &str, more: &str) -> Environment {
    // Clients keep to the router; what peers miss while they change to a direct link may come late.
    let overrides =
        format!("mode=\"client\";connect/endpoints=[\"{endpoint}\"];listen/endpoints=[];{more}");
    Environment {
        rmw: Rmw::Zenoh,
        zenoh: ZenohSettings {
            file: None,
            overrides: Some(overrides),
        },
        ..Environment::localhost(domain_id)
    }
}

/// A domain of its own at this process's router.
pub fn isolated() -> Environment {
    static ROUTER: OnceLock<Router> = OnceLock::new();
    static NEXT: AtomicU16 = AtomicU16::new(1);
    let router = ROUTER.get_or_init(|| Router::start(&[]));
    router.environment(NEXT.fetch_add(1, Ordering::Relaxed) % 200)
}

pub fn node(name: &str, environment: &Environment) -> RosNode {
    let (args, _) = NodeArgs::parse(name, []).unwrap();
    RosNode::new(&args, environment).unwrap()
}

/// A name that no test in another process has.
pub fn own_name(name: &str) -> String {
    format!("{name}_{}", process::id())
}
