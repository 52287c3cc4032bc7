//! A node of the flight: its process, and what it reports.

use std::io::{BufReader, Read};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use lgvi_common::Event;
use lgvi_middleware::node::NodeError;
use lgvi_middleware::report::{ReportError, read_reports};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::NodeKind;

/// What was heard of a node.
pub(crate) type Update = (NodeKind, Heard);

/// Something on a node's standard output.
#[derive(Debug)]
pub(crate) enum Heard {
    Event(Box<Event>),
    /// Something that is no event, and why.
    Nonsense(String),
    /// The node has closed its output, which is when it ends.
    End,
}

/// How long a node may take to end when it is told to.
const PATIENCE: Duration = Duration::from_secs(15);

/// How often an ending node is looked at.
const WAIT: Duration = Duration::from_millis(5);

/// A node's process. When this one dies, however, its end of the node's standard input closes, and the node ends too.
pub(crate) struct NodeProcess {
    child: Child,
    _lifeline: Option<ChildStdin>,
}

impl NodeProcess {
    /// Starts the node with ROS arguments; its reports go to `updates`.
    pub(crate) fn start(
        kind: NodeKind,
        arguments: Vec<String>,
        updates: Sender<Update>,
    ) -> Result<Self, NodeError> {
        let program = std::env::current_exe().map_err(NodeError::runtime)?;
        let name = kind.name();
        let mut command = Command::new(program);
        command
            .args(["node", name, "--supervised"])
            .args(arguments)
            .args(["--log-level", "warn"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        // A demonstration stays on its host unless the user has said how far it may reach.
        let said = ["ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"];
        if said
            .iter()
            .all(|variable| std::env::var_os(variable).is_none())
        {
            command.env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
        }
        // Ctrl-C reaches this process alone, which then ends the nodes in order.
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command
            .spawn()
            .map_err(|error| NodeError::Runtime(format!("cannot start the {name}: {error}")))?;
        let lifeline = child.stdin.take();
        if let Some(output) = child.stdout.take() {
            std::thread::spawn(move || listen(kind, output, &updates));
        }
        Ok(Self {
            child,
            _lifeline: lifeline,
        })
    }

    /// Asks the node to end, and makes it if it does not.
    pub(crate) fn stop(&mut self) -> Option<ExitStatus> {
        if let Ok(pid) = i32::try_from(self.child.id()) {
            // One that has ended already needs no signal.
            let _ = kill(Pid::from_raw(pid), Signal::SIGINT);
        }
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            match self.child.try_wait() {
                Ok(None) => std::thread::sleep(WAIT),
                Ok(Some(status)) => return Some(status),
                Err(_) => break,
            }
        }
        let _ = self.child.kill();
        self.child.wait().ok()
    }
}

/// How a process was killed, if it was.
pub(crate) fn death(status: ExitStatus) -> Option<String> {
    let number = status.signal()?;
    let Ok(signal) = Signal::try_from(number) else {
        return Some(format!("killed by signal {number}"));
    };
    let cause = match signal {
        Signal::SIGBUS => ", probably because /dev/shm is full",
        _ => "",
    };
    Some(format!("killed by {signal}{cause}"))
}

/// Passes on what a node says until its end, or until nobody wants to know.
pub(crate) fn listen(kind: NodeKind, output: impl Read, updates: &Sender<Update>) {
    for report in read_reports(BufReader::new(output)) {
        let (heard, more) = match report {
            Ok(event) => (Heard::Event(Box::new(event)), true),
            Err(error @ ReportError::Parse { .. }) => (Heard::Nonsense(error.to_string()), true),
            Err(error @ ReportError::Read(_)) => (Heard::Nonsense(error.to_string()), false),
        };
        if updates.send((kind, heard)).is_err() {
            return;
        }
        if !more {
            break;
        }
    }
    let _ = updates.send((kind, Heard::End));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_that_has_killed_a_node_is_named() {
        let killed = |signal: Signal| death(ExitStatus::from_raw(signal as i32));
        let bus = "killed by SIGBUS, probably because /dev/shm is full";
        assert_eq!(killed(Signal::SIGBUS).as_deref(), Some(bus));
        let kill = "killed by SIGKILL";
        assert_eq!(killed(Signal::SIGKILL).as_deref(), Some(kill));
        assert_eq!(death(ExitStatus::from_raw(0)), None);
    }
}
