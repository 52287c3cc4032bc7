//! Python with the packages of `tests/python/requirements.txt`.

use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

use crate::{Process, World, root};

/// The interpreter; the first to ask for it on a machine waits until it is set up.
pub fn python() -> PathBuf {
    static PYTHON: OnceLock<PathBuf> = OnceLock::new();
    PYTHON
        .get_or_init(|| {
            let script = root().join("tests/python/environment.py");
            let output = Command::new("python3").arg(&script).output();
            let output = output.expect("python3, which the tests need");
            let stderr = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{}:\n{stderr}", script.display());
            PathBuf::from(String::from_utf8_lossy(&output.stdout).trim())
        })
        .clone()
}

impl World {
    /// Starts a script of `tests/python`.
    pub fn python(&self, script: &str, arguments: &[&str]) -> Process {
        let mut command = self.command(&python());
        command
            .arg(root().join("tests/python").join(script))
            .args(arguments);
        self.start(script, command)
    }
}
