//! Python with the packages of `tests/python/requirements.txt`, and Python with ROS 2 Jazzy.

use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

use crate::{Process, World, root};

/// Variables by which a shell that has sourced a ROS or Python of its own would reach into ours.
const FOREIGN: [&str; 3] = ["LD_LIBRARY_PATH", "PYTHONPATH", "PYTHONHOME"];

/// The interpreter; the first to ask for it on a machine waits until it is set up.
pub fn python() -> PathBuf {
    static PYTHON: OnceLock<PathBuf> = OnceLock::new();
    PYTHON
        .get_or_init(|| printed_by("tests/python/environment.py"))
        .clone()
}

/// An interpreter with rclpy, the standard messages and ours; the first to ask for it waits until colcon has built them.
pub fn ros_python() -> PathBuf {
    static PYTHON: OnceLock<PathBuf> = OnceLock::new();
    PYTHON
        .get_or_init(|| printed_by("tests/python/ros_environment.py"))
        .clone()
}

fn printed_by(script: &str) -> PathBuf {
    let script = root().join(script);
    let output = Command::new("python3").arg(&script).output();
    let output = output.expect("python3, which the tests need");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}:\n{stderr}", script.display());
    PathBuf::from(String::from_utf8_lossy(&output.stdout).trim())
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

    /// Starts a script of `tests/python` on ROS 2 Jazzy with Fast DDS.
    pub fn ros_python(&self, script: &str, arguments: &[&str]) -> Process {
        self.start(script, self.ros_command(script, arguments))
    }

    /// A command that runs a script of `tests/python` on ROS 2 Jazzy with Fast DDS.
    pub fn ros_command(&self, script: &str, arguments: &[&str]) -> Command {
        self.ros_script(self.command(&ros_python()), script, arguments)
    }

    /// Has a command that ends with [`ros_python`] run a script of `tests/python`.
    pub(crate) fn ros_script(
        &self,
        mut command: Command,
        script: &str,
        arguments: &[&str],
    ) -> Command {
        let python = ros_python();
        let environment = python.ancestors().nth(2).expect("<environment>/bin/python");
        for name in FOREIGN {
            command.env_remove(name);
        }
        command
            .env("AMENT_PREFIX_PATH", environment)
            .env("ROS_LOG_DIR", self.path("ros_log"))
            .env("TMPDIR", self.path(""))
            // Its shared memory would outlive a peer that is killed.
            .env("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .arg(root().join("tests/python").join(script))
            .args(arguments);
        command
    }
}
