//! Nodes that cannot meet those of other tests.

use std::{
    env,
    path::PathBuf,
    process::{self, Command},
    sync::atomic::{AtomicU32, Ordering},
};

use lgvi_middleware::{Environment, NodeArgs, ros::RosNode};

/// A domain of its own on the loopback interface; the ports of those above 101 are among those that Linux gives to
/// any socket.
pub fn isolated() -> Environment {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let serial = process::id()
        .wrapping_mul(16)
        .wrapping_add(NEXT.fetch_add(1, Ordering::Relaxed));
    Environment::localhost(1 + (serial % 101) as u16)
}

pub fn node(name: &str, environment: &Environment) -> RosNode {
    let (args, _) = NodeArgs::parse(name, []).unwrap();
    RosNode::new(&args, environment).unwrap()
}

/// A name that no test in another process has, should it be in the same domain.
pub fn own_name(name: &str) -> String {
    format!("{name}_{}", process::id())
}

/// A script of `tests/python`, run by a Python with Cyclone DDS in the domain of `environment`.
pub fn python_peer(script: &str, environment: &Environment) -> Command {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    let python = env::var_os("LGVI_PYTHON")
        .map_or_else(|| root.join("target/python-env/bin/python"), PathBuf::from);
    assert!(
        python.exists(),
        "{} is missing: make a venv and install cyclonedds==11.0.1",
        python.display()
    );
    let mut command = Command::new(python);
    command
        .arg(root.join("tests/python").join(script))
        .args(["--domain", &environment.domain_id.to_string()]);
    command
}
