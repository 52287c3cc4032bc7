//! Peers: programs of others, run by a Python that has them.

mod flyer;
mod process;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

pub(crate) use flyer::{Flyer, Tuning};
pub(crate) use process::Process;

/// A peer: its module and the script that drives it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peer {
    /// As its users call it.
    pub name: &'static str,
    module: &'static str,
    script: &'static str,
}

macro_rules! script {
    ($file:literal) => {
        concat!(env!("CARGO_MANIFEST_DIR"), "/peers/", $file)
    };
}

/// Those that integrate.
pub(crate) const INTEGRATORS: [Peer; 5] = [
    HEYOKA,
    Peer::new("SciPy", "scipy", script!("scipy_peer.py")),
    REBOUND,
    Peer::new("Basilisk", "Basilisk", script!("basilisk_peer.py")),
    Peer::new("MuJoCo", "mujoco", script!("mujoco_peer.py")),
];

pub(crate) const HEYOKA: Peer = Peer::new("heyoka", "heyoka", script!("heyoka_peer.py"));
pub(crate) const REBOUND: Peer = Peer::new("REBOUND", "rebound", script!("rebound_peer.py"));
pub(crate) const CASADI: Peer = Peer::new("CasADi", "casadi", script!("casadi_peer.py"));

impl Peer {
    const fn new(name: &'static str, module: &'static str, script: &'static str) -> Self {
        Self {
            name,
            module,
            script,
        }
    }
}

/// A Python in which peers may be installed.
pub(crate) struct Python(PathBuf);

impl Python {
    pub(crate) fn new(interpreter: PathBuf) -> Self {
        Self(interpreter)
    }

    fn interpreter(&self) -> &Path {
        &self.0
    }

    /// Whether it has the peer.
    pub(crate) fn has(&self, peer: Peer) -> bool {
        let imported = Command::new(&self.0)
            .args(["-c", &format!("import {}", peer.module)])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        imported.is_ok_and(|status| status.success())
    }
}

/// Of `peers` those that are not installed; all without a Python.
pub(crate) fn missing(python: Option<&Python>, peers: &[Peer]) -> Vec<&'static str> {
    let missing = |peer: &&Peer| python.is_none_or(|python| !python.has(**peer));
    peers.iter().filter(missing).map(|peer| peer.name).collect()
}
