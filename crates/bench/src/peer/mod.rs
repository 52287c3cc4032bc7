//! Peers: programs of others, run by a Python that has them, and loops in C++.

mod compiled;
mod flyer;
mod process;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

pub(crate) use compiled::compiled;
pub(crate) use flyer::{Flyer, Tuning, read_case};
pub(crate) use process::Process;

use crate::error::BenchError;

/// A peer: its module and the script that drives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
#[derive(Clone, Debug)]
pub(crate) struct Python(PathBuf);

impl Python {
    /// # Errors
    /// The interpreter cannot be run.
    pub(crate) fn new(interpreter: PathBuf) -> Result<Self, BenchError> {
        let refuse = |why: &dyn std::fmt::Display| {
            let interpreter = interpreter.display();
            BenchError::Peer(format!("{interpreter} is no Python that runs: {why}"))
        };
        let status = Command::new(&interpreter)
            .args(["-c", "import sys"])
            .stdin(Stdio::null())
            .status()
            .map_err(|error| refuse(&error))?;
        match status.success() {
            true => Ok(Self(interpreter)),
            false => Err(refuse(&status)),
        }
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
pub(crate) fn missing(python: Option<&Python>, peers: &[Peer]) -> Vec<Peer> {
    let missing = |peer: &&Peer| python.is_none_or(|python| !python.has(**peer));
    peers.iter().filter(missing).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::{Peer, Python};

    /// What runs scripts of the shell.
    pub(super) fn shell() -> Python {
        Python("/bin/sh".into())
    }

    /// A peer with this script, which is there as long as the file.
    pub(super) fn written(script: &str) -> (Peer, tempfile::TempPath) {
        let file = tempfile::NamedTempFile::new().unwrap().into_temp_path();
        std::fs::write(&file, script).unwrap();
        let path: &str = file.to_str().unwrap().to_owned().leak();
        (Peer::new("peer", "peer", path), file)
    }

    #[test]
    fn an_interpreter_that_cannot_be_run_is_refused() {
        for path in ["/nonexistent", "/bin/false"] {
            let error = Python::new(path.into()).unwrap_err().to_string();
            assert!(error.starts_with(path), "{error}");
        }
    }
}
