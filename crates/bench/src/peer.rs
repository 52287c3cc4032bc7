//! A Python with peers, and heyoka run by it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use lgvi_truth::Case;
use serde::Deserialize;

use crate::error::BenchError;

/// A Python with peers.
pub(crate) struct Peer {
    python: PathBuf,
}

/// One tolerance's flight.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(crate) struct PeerFlown {
    pub tolerance: f64,
    pub seconds: f64,
    pub position: f64,
    pub attitude: f64,
}

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/heyoka_peer.py");

impl Peer {
    pub(crate) fn new(python: PathBuf) -> Self {
        Self { python }
    }

    /// The interpreter.
    pub(crate) fn python(&self) -> &Path {
        &self.python
    }

    /// Flies the case to `t` with each of the tolerances.
    pub(crate) fn fly(
        &self,
        case: &str,
        t: f64,
        tolerances: &[f64],
        repeats: u32,
    ) -> Result<Vec<PeerFlown>, BenchError> {
        let python = self.python.display();
        let output = Command::new(&self.python)
            .arg(SCRIPT)
            .arg(Case::path(case))
            .args([t.to_string(), repeats.to_string()])
            .args(tolerances.iter().map(f64::to_string))
            .stderr(Stdio::inherit())
            .output()
            .map_err(|error| BenchError::Peer(format!("{python}: {error}")))?;
        if !output.status.success() {
            let message = format!("{python} {SCRIPT} ended with {}", output.status);
            return Err(BenchError::Peer(message));
        }
        String::from_utf8_lossy(&output.stdout)
            .lines()
            .map(|line| {
                serde_json::from_str(line)
                    .map_err(|error| BenchError::Peer(format!("{line:?}: {error}")))
            })
            .collect()
    }
}
