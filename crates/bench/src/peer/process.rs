//! A script that answers lines of JSON.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::{Peer, Python};
use crate::error::BenchError;

/// A peer's running script; it ends when its input does.
pub(crate) struct Process {
    peer: Peer,
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
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
        Ok(Self {
            peer,
            child,
            input: Some(input),
            output: BufReader::new(output),
        })
    }

    /// What it says next.
    pub(crate) fn hear<Answer: DeserializeOwned>(&mut self) -> Result<Answer, BenchError> {
        let mut line = String::new();
        let read = self.output.read_line(&mut line);
        read.map_err(|error| self.refuse(&error.to_string()))?;
        serde_json::from_str(&line).map_err(|error| self.refuse(&format!("{error} in {line:?}")))
    }

    /// What it answers.
    pub(crate) fn ask<Answer: DeserializeOwned>(
        &mut self,
        request: &Value,
    ) -> Result<Answer, BenchError> {
        let sent = self
            .input
            .as_mut()
            .map_or(Ok(()), |input| writeln!(input, "{request}"));
        sent.map_err(|error| self.refuse(&error.to_string()))?;
        self.hear()
    }

    fn refuse(&self, error: &str) -> BenchError {
        BenchError::Peer(format!("{}: {error}", self.peer.script))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.input = None;
        let _ = self.child.wait();
    }
}
