//! How long a node takes to end, and what is left of it.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use lgvi_middleware::ros::RosNode;
use nix::sys::signal::Signal;

use crate::{Finished, Process, World, within};

/// How soon after its end others know that a node is gone.
const GONE: Duration = Duration::from_secs(1);

impl Process {
    /// Sends it a signal and waits for its end; says how long that took.
    #[track_caller]
    pub fn end(self, signal: Signal) -> (Finished, Duration) {
        let asked = Instant::now();
        self.signal(signal);
        let finished = self.finish();
        (finished, asked.elapsed())
    }

    /// Stops it, as Ctrl-Z does: it keeps all that it has and does nothing any more.
    pub fn suspend(&self) {
        self.signal(Signal::SIGSTOP);
    }
}

impl World {
    /// The locks of nodes that run, and of those that were killed.
    pub fn locks(&self) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(self.path("shm")).expect("a directory");
        let mut locks: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
        locks.retain(|path| path.to_string_lossy().contains("lgvi_node"));
        locks
    }
}

/// Waits until `observer` knows of a node.
#[track_caller]
pub fn await_node(observer: &RosNode, name: &str) {
    within(crate::PATIENCE, name, || {
        knows(observer, name).then_some(())
    });
}

/// Panics unless `observer` soon knows of no node of this name, and of no endpoint below it.
#[track_caller]
pub fn assert_gone(observer: &RosNode, name: &str) {
    within(GONE, &format!("{name} to be gone from the graph"), || {
        let below = format!("{name}/");
        let topics = observer.topics();
        let offered = |topic: &&_| {
            let topic: &lgvi_middleware::ros::TopicInfo = topic;
            topic.publishers > 0 && topic.name.starts_with(&below)
        };
        (!knows(observer, name) && topics.iter().find(offered).is_none()).then_some(())
    });
}

fn knows(observer: &RosNode, name: &str) -> bool {
    observer.other_nodes().iter().any(|other| other == name)
}

/// Prints what a test has measured, for who wants to see it.
pub fn note(measured: &str) {
    eprintln!("{measured}");
}
