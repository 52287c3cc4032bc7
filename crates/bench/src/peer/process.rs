//! A script that answers lines of JSON.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::{Peer, Python};
use crate::error::BenchError;

/// How long a script whose input has ended may take to end.
const FAREWELL: Duration = Duration::from_secs(5);

/// A peer's running script; it ends when its input does.
pub(crate) struct Process {
    peer: Peer,
    child: Child,
    input: Option<ChildStdin>,
    lines: Receiver<std::io::Result<String>>,
}

impl Process {
    pub(crate) fn start(python: &Python, peer: Peer) -> Result<Self, BenchError> {
        let refuse = |error: &str| {
            let interpreter = python.interpreter().display();
            BenchError::Peer(format!("{interpreter} {}: {error}", peer.script))
        };
        let mut child = Command::new(python.interpreter())
            .arg(peer.script)
            // a library's pool of threads would not be counted
            .env("OMP_NUM_THREADS", "1")
            .env("OPENBLAS_NUM_THREADS", "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| refuse(&error.to_string()))?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(refuse("no pipes"));
        };
        let (heard, lines) = channel();
        thread::spawn(move || {
            for line in BufReader::new(output).lines() {
                if heard.send(line).is_err() {
                    break;
                }
            }
        });
        Ok(Self {
            peer,
            child,
            input: Some(input),
            lines,
        })
    }

    /// What it says next; it is ended where it says nothing within `limit`.
    pub(crate) fn hear<Answer: DeserializeOwned>(
        &mut self,
        limit: Duration,
    ) -> Result<Answer, BenchError> {
        let line = match self.lines.recv_timeout(limit) {
            Ok(line) => line.map_err(|error| self.refuse(&error.to_string()))?,
            Err(RecvTimeoutError::Disconnected) => return Err(self.refuse("it has ended")),
            Err(RecvTimeoutError::Timeout) => {
                // Where it cannot be ended it has ended.
                let _ = self.child.kill();
                return Err(self.refuse(&format!("no answer for {} s", limit.as_secs_f64())));
            }
        };
        serde_json::from_str(&line).map_err(|error| self.refuse(&format!("{error} in {line:?}")))
    }

    /// What it answers within `limit`.
    pub(crate) fn ask<Answer: DeserializeOwned>(
        &mut self,
        request: &Value,
        limit: Duration,
    ) -> Result<Answer, BenchError> {
        let sent = self
            .input
            .as_mut()
            .map_or(Ok(()), |input| writeln!(input, "{request}"));
        sent.map_err(|error| self.refuse(&error.to_string()))?;
        self.hear(limit)
    }

    fn refuse(&self, error: &str) -> BenchError {
        BenchError::Peer(format!("{}: {error}", self.peer.script))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.input = None;
        let begun = Instant::now();
        while matches!(self.child.try_wait(), Ok(None)) {
            if begun.elapsed() > FAREWELL {
                let _ = self.child.kill();
                let _ = self.child.wait();
                return;
            }
            thread::sleep(Duration::from_millis(5));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use serde_json::{Value, json};

    use super::Process;
    use crate::peer::tests::{shell, written};

    const LONG: Duration = Duration::from_secs(60);

    #[test]
    fn a_script_answers_and_one_that_has_ended_or_says_nothing_is_refused() {
        let [cat, exit, sleep] = ["exec cat", "exit 3", "exec sleep 60"].map(written);
        let mut echo = Process::start(&shell(), cat.0).unwrap();
        let request = json!({"a": 1});
        assert_eq!(echo.ask::<Value>(&request, LONG).unwrap(), request);

        let mut ended = Process::start(&shell(), exit.0).unwrap();
        let error = ended.hear::<Value>(LONG).unwrap_err().to_string();
        assert!(error.ends_with("it has ended"), "{error}");

        let begun = Instant::now();
        let mut silent = Process::start(&shell(), sleep.0).unwrap();
        let error = silent.ask::<Value>(&request, Duration::from_millis(50));
        let error = error.unwrap_err().to_string();
        assert!(error.ends_with("no answer for 0.05 s"), "{error}");
        drop(silent);
        assert!(begun.elapsed() < LONG / 4);
    }
}
