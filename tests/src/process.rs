//! A program under test while it runs, and when it has ended.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use lgvi_common::{Event, FlightReport};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::eventually;

/// What a process has printed so far.
#[derive(Debug)]
pub(crate) struct Printed {
    name: String,
    stdout: Mutex<String>,
    stderr: Mutex<String>,
}

impl Printed {
    /// Both streams, to be shown when a test fails.
    pub(crate) fn report(&self) -> String {
        let (stdout, stderr) = (text(&self.stdout), text(&self.stderr));
        format!(
            "--- {} stdout:\n{stdout}\n--- {} stderr:\n{stderr}",
            self.name, self.name
        )
    }
}

/// A running program. It is killed when this is dropped, and its standard input ends when the test does.
#[derive(Debug)]
pub struct Process {
    child: Child,
    printed: Arc<Printed>,
    readers: Vec<JoinHandle<()>>,
    stdin: Option<ChildStdin>,
}

/// A program that has ended.
#[derive(Debug)]
pub struct Finished {
    /// What it was called.
    pub name: String,
    /// Exit code; `None` if a signal ended it.
    pub code: Option<i32>,
    /// All of its standard output.
    pub stdout: String,
    /// All of its standard error.
    pub stderr: String,
}

impl Process {
    pub(crate) fn start(name: &str, mut command: Command) -> Self {
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{name} does not start: {command:?}: {error}"));
        let printed = Arc::new(Printed {
            name: name.into(),
            stdout: Mutex::default(),
            stderr: Mutex::default(),
        });
        let readers = [
            child
                .stdout
                .take()
                .map(|stream| read(stream, &printed, |printed| &printed.stdout)),
            child
                .stderr
                .take()
                .map(|stream| read(stream, &printed, |printed| &printed.stderr)),
        ];
        Self {
            readers: readers.into_iter().flatten().collect(),
            stdin: child.stdin.take(),
            child,
            printed,
        }
    }

    /// Its process id.
    pub fn pid(&self) -> i32 {
        i32::try_from(self.child.id()).expect("a process id")
    }

    /// Its standard input.
    pub fn stdin(&mut self) -> &mut ChildStdin {
        self.stdin.as_mut().expect("a pipe")
    }

    /// Its standard output so far.
    pub fn stdout(&self) -> String {
        text(&self.printed.stdout)
    }

    /// Its standard error so far.
    pub fn stderr(&self) -> String {
        text(&self.printed.stderr)
    }

    /// Writes a line to its standard input.
    pub fn tell(&mut self, line: &str) {
        let stdin = self.stdin.as_mut().expect("a standard input");
        writeln!(stdin, "{line}").expect("a process that reads");
    }

    /// Waits until its standard error holds `fragment`.
    #[track_caller]
    pub fn await_stderr(&self, fragment: &str) {
        let awaited = format!(
            "{fragment:?} on the standard error of {}",
            self.printed.name
        );
        eventually(&awaited, || self.stderr().contains(fragment).then_some(()));
    }

    /// Waits for the first event that `choose` accepts, of a node that was started with `--supervised`.
    #[track_caller]
    pub fn await_event<T>(&self, awaited: &str, choose: impl Fn(&Event) -> Option<T>) -> T {
        let awaited = format!("the event {awaited:?} of {}", self.printed.name);
        eventually(&awaited, || {
            let stdout = self.stdout();
            let mut events = stdout
                .lines()
                .filter_map(|line| serde_json::from_str(line).ok());
            events.find_map(|event| choose(&event))
        })
    }

    /// Waits until a node has opened all its ports.
    #[track_caller]
    pub fn await_ready(&self) {
        self.await_event("ready", |event| matches!(event, Event::Ready).then_some(()));
    }

    /// Waits until a propagator has made all steps.
    #[track_caller]
    pub fn await_flown(&self) -> FlightReport {
        self.await_event("flown", |event| match event {
            Event::Flown(report) => Some(report.clone()),
            _ => None,
        })
    }

    /// Whether it still runs.
    pub fn runs(&mut self) -> bool {
        self.status().is_none()
    }

    /// Sends it a signal.
    pub fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.pid()), signal).expect("a process that runs");
    }

    /// Waits for its end.
    #[track_caller]
    pub fn finish(mut self) -> Finished {
        let name = self.printed.name.clone();
        let status = eventually(&format!("the end of {name}"), || self.status());
        let streams = format!("the end of what {name} and its children print");
        eventually(&streams, || {
            self.readers
                .iter()
                .all(JoinHandle::is_finished)
                .then_some(())
        });
        Finished {
            name,
            code: status.code(),
            stdout: self.stdout(),
            stderr: self.stderr(),
        }
    }

    /// Asks it to end as Ctrl-C does, and waits for its end.
    #[track_caller]
    pub fn stop(self) -> Finished {
        self.signal(Signal::SIGINT);
        self.finish()
    }

    pub(crate) fn printed(&self) -> Arc<Printed> {
        Arc::clone(&self.printed)
    }

    fn status(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().expect("the state of a child")
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // One that has ended is gone already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Finished {
    /// Panics unless it ended with this exit code.
    #[track_caller]
    pub fn expect(self, code: i32) -> Self {
        assert_eq!(
            self.code,
            Some(code),
            "exit code of {}:\n{}{}",
            self.name,
            self.stdout,
            self.stderr
        );
        self
    }

    /// Panics unless all fragments are in its standard error.
    #[track_caller]
    pub fn says(&self, fragments: &[&str]) {
        for fragment in fragments {
            assert!(
                self.stderr.contains(fragment),
                "{fragment:?} is not in:\n{}",
                self.stderr
            );
        }
    }
}

fn read(
    stream: impl Read + Send + 'static,
    printed: &Arc<Printed>,
    of: fn(&Printed) -> &Mutex<String>,
) -> JoinHandle<()> {
    let printed = Arc::clone(printed);
    thread::spawn(move || {
        let mut stream = BufReader::new(stream);
        let mut line = Vec::new();
        while stream
            .read_until(b'\n', &mut line)
            .is_ok_and(|length| length > 0)
        {
            let text = String::from_utf8_lossy(&line);
            of(&printed)
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push_str(&text);
            line.clear();
        }
    })
}

fn text(stream: &Mutex<String>) -> String {
    stream
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .clone()
}
