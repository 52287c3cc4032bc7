//! The recorder's process.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use nix::sys::signal::{Signal, kill};
use nix::time::{clock_getcpuclockid, clock_gettime};
use nix::unistd::Pid;

use super::{PATIENCE, text};
use crate::error::BenchError;

/// A recorder's process, which ends when this is dropped.
pub(super) struct Recorder {
    child: Child,
    events: Receiver<serde_json::Value>,
}

impl Recorder {
    /// Starts it with parameters, in a domain and below a directory for shared memory.
    pub(super) fn start(
        parameters: &[String],
        domain: u16,
        shm: &Path,
    ) -> Result<Self, BenchError> {
        let this = std::env::current_exe().map_err(text)?;
        let program = this.with_file_name("lgvi_recorder");
        let mut command = Command::new(&program);
        command.args(["--supervised", "--ros-args"]);
        for parameter in parameters {
            command.args(["-p", parameter]);
        }
        let mut child = command
            .env("ROS_DOMAIN_ID", domain.to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .env("LGVI_SHM_ROOT", shm)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| {
                let program = program.display();
                text(format!(
                    "{program}, which `cargo build -p lgvi` makes: {error}"
                ))
            })?;
        let (sender, events) = channel();
        if let Some(stdout) = child.stdout.take() {
            thread::spawn(move || {
                for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                    let event: serde_json::Value = serde_json::from_str(&line).unwrap_or_default();
                    if event["event"] != "recording" && sender.send(event).is_err() {
                        return;
                    }
                }
            });
        }
        Ok(Self { child, events })
    }

    fn pid(&self) -> Pid {
        Pid::from_raw(self.child.id().cast_signed())
    }

    /// Seconds that it has been on the processor, with all its threads.
    pub(super) fn cpu(&self) -> Result<f64, BenchError> {
        let time = clock_getcpuclockid(self.pid()).and_then(clock_gettime);
        let time = time.map_err(text)?;
        Ok(time.tv_sec() as f64 + 1e-9 * time.tv_nsec() as f64)
    }

    /// Waits for an event of its.
    pub(super) fn await_event(&self, name: &str) -> Result<serde_json::Value, BenchError> {
        loop {
            let event = self.events.recv_timeout(PATIENCE);
            let event = event.map_err(|_| text(format!("waited in vain for {name}")))?;
            if event["event"] == name {
                return Ok(event);
            }
        }
    }

    /// Has it close the bag.
    pub(super) fn finish(self) -> Result<serde_json::Value, BenchError> {
        kill(self.pid(), Signal::SIGINT).map_err(text)?;
        self.await_event("recorded")
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // One that has ended is gone already.
        let _ = kill(self.pid(), Signal::SIGINT);
        let _ = self.child.wait();
    }
}
