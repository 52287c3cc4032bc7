//! Subscriptions whose process is stopped, and what that does to others.
//!
//! Needs a Python with PyPI `cyclonedds` 11.0.1: `target/python-env`, or what `LGVI_PYTHON` names.

use std::{
    io::{BufRead, BufReader},
    process::{Child, Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use crate::common::{isolated, node, python_peer};
use lgvi_middleware::{
    Environment,
    ros::{Publisher, Qos},
};
use lgvi_msgs::nav_msgs::Odometry;
use nix::{
    sys::signal::{Signal, kill},
    unistd::Pid,
};
use serde_json::Value;

const PATIENCE: Duration = Duration::from_secs(20);

/// A publisher's, and how many samples may be unacknowledged at this depth.
const DEPTH: usize = 10;
const WINDOW: usize = 512;

/// How long a publisher waits for a subscription that holds it up, the first time.
const WAIT: Duration = Duration::from_millis(100);

/// That and 20 ms to make room, with a margin for a machine that has other things to do.
const SLOWEST: Duration = Duration::from_millis(500);

/// A subscription of Cyclone DDS, and the numbers of the messages it has received.
struct Peer {
    process: Child,
    received: Arc<AtomicUsize>,
    reading: Option<JoinHandle<Vec<usize>>>,
}

impl Peer {
    fn subscribe(environment: &Environment, topic: &str, qos: &str, count: usize) -> Self {
        let peer = python_peer("cyclone_peer.py", environment);
        Self::start(peer, topic, qos, count)
    }

    fn start(mut peer: Command, topic: &str, qos: &str, count: usize) -> Self {
        let mut process = peer
            .args(["--timeout", "60", "--odometry", topic, "--qos", qos])
            .args(["--count", &count.to_string()])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let received = Arc::new(AtomicUsize::new(0));
        let (output, count) = (process.stdout.take().unwrap(), Arc::clone(&received));
        let reading = thread::spawn(move || {
            BufReader::new(output)
                .lines()
                .map(|line| {
                    let sample: Value = serde_json::from_str(&line.unwrap()).unwrap();
                    count.fetch_add(1, Ordering::Relaxed);
                    let number = sample["pose"]["pose"]["position"]["x"].as_f64().unwrap();
                    number as usize
                })
                .collect()
        });
        Self {
            process,
            received,
            reading: Some(reading),
        }
    }

    /// Waits until it has found its publisher.
    fn matched(&mut self) {
        let mut line = String::new();
        BufReader::new(self.process.stderr.as_mut().unwrap())
            .read_line(&mut line)
            .unwrap();
        assert_eq!(line.trim(), "matched");
    }

    fn signal(&self, signal: Signal) {
        let id = i32::try_from(self.process.id()).unwrap();
        kill(Pid::from_raw(id), signal).unwrap();
    }

    /// Waits until it has received so many.
    fn await_received(&self, count: usize) {
        let start = Instant::now();
        while self.received.load(Ordering::Relaxed) < count {
            assert!(start.elapsed() < PATIENCE, "{:?}", self.received);
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// What it has received once it has so many or the time has passed.
    fn numbers(mut self, count: usize, timeout: Duration) -> Vec<usize> {
        let start = Instant::now();
        while self.received.load(Ordering::Relaxed) < count && start.elapsed() < timeout {
            thread::sleep(Duration::from_millis(5));
        }
        self.process.kill().unwrap();
        self.reading.take().unwrap().join().unwrap()
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Publishes the numbers of a range, that many in a second; returns how long the slowest call took.
fn publish(
    publisher: &Publisher<Odometry>,
    numbers: std::ops::Range<usize>,
    rate: f64,
) -> Duration {
    let start = Instant::now();
    let first = numbers.start;
    let mut slowest = Duration::ZERO;
    for number in numbers {
        let due = Duration::from_secs_f64((number - first) as f64 / rate);
        thread::sleep(due.saturating_sub(start.elapsed()));
        let mut message = Odometry::default();
        message.pose.pose.position.x = number as f64;
        let call = Instant::now();
        publisher.publish(&message).unwrap();
        slowest = slowest.max(call.elapsed());
    }
    slowest
}

#[test]
fn a_stopped_subscription_takes_nothing_from_another_and_recovers() {
    const STOPPED: usize = 20;
    const CONTINUED: usize = 3 * WINDOW;
    const END: usize = CONTINUED + 100;
    let environment = isolated();
    let publisher = node("sender", &environment)
        .publisher("/odometry", &Qos::reliable(DEPTH))
        .unwrap();
    let mut healthy = Peer::subscribe(&environment, "/odometry", "reliable", END);
    let mut stopped = Peer::subscribe(&environment, "/odometry", "reliable", END);
    assert!(publisher.wait_for_subscriptions(2, PATIENCE));
    healthy.matched();
    stopped.matched();
    publish(&publisher, 0..STOPPED, 200.0);
    stopped.signal(Signal::SIGSTOP);
    let slowest = publish(&publisher, STOPPED..CONTINUED, 250.0);
    stopped.signal(Signal::SIGCONT);
    publish(&publisher, CONTINUED..END, 250.0);
    let all: Vec<_> = (0..END).collect();
    assert_eq!(healthy.numbers(END, PATIENCE), all);
    let numbers = stopped.numbers(END, Duration::from_secs(2));
    assert!(numbers.is_sorted());
    assert!(numbers.starts_with(&all[..STOPPED]));
    assert!(numbers.ends_with(&all[CONTINUED - DEPTH..]), "{numbers:?}");
    // The wait in vain, after which the window was made free.
    assert!(slowest >= WAIT && slowest < SLOWEST, "{slowest:?}");
    assert_eq!((publisher.sent(), publisher.dropped()), (END as u64, 0));
}

#[test]
fn a_stopped_latched_subscription_does_not_hold_up_rare_messages() {
    const STOPPED: usize = 2;
    const END: usize = 60;
    let environment = isolated();
    let publisher = node("sender", &environment)
        .publisher("/plan", &Qos::latched(1))
        .unwrap();
    let mut healthy = Peer::subscribe(&environment, "/plan", "latched", END);
    let mut stopped = Peer::subscribe(&environment, "/plan", "latched", END);
    assert!(publisher.wait_for_subscriptions(2, PATIENCE));
    healthy.matched();
    stopped.matched();
    publish(&publisher, 0..STOPPED, 50.0);
    stopped.signal(Signal::SIGSTOP);
    let slowest = publish(&publisher, STOPPED..END, 50.0);
    let late = Peer::subscribe(&environment, "/plan", "latched", 1);
    let all: Vec<_> = (0..END).collect();
    assert_eq!(healthy.numbers(END, PATIENCE), all);
    assert_eq!(late.numbers(1, PATIENCE).len(), 1);
    stopped.signal(Signal::SIGCONT);
    let numbers = stopped.numbers(END, Duration::from_secs(2));
    assert_eq!(numbers.last(), Some(&(END - 1)), "{numbers:?}");
    assert!(slowest < SLOWEST, "{slowest:?}");
    assert_eq!((publisher.sent(), publisher.dropped()), (END as u64, 0));
}

/// As by Ctrl-Z. RustDDS would not match it again.
#[test]
#[cfg(target_os = "linux")]
fn a_subscription_that_is_stopped_for_longer_than_its_lease_goes_on() {
    const LEASE: Duration = Duration::from_secs(5);
    const CONFIGURATION: &str = "<CycloneDDS><Domain id='any'>\
        <General><Interfaces><NetworkInterface name='lo'/></Interfaces><AllowMulticast>false</AllowMulticast></General>\
        <Discovery><LeaseDuration>5s</LeaseDuration><ParticipantIndex>auto</ParticipantIndex>\
        <Peers><Peer address='localhost'/></Peers></Discovery></Domain></CycloneDDS>";
    const BEFORE: usize = 10;
    const END: usize = 20;
    let environment = isolated();
    let publisher = node("sender", &environment)
        .publisher("/odometry", &Qos::reliable(DEPTH))
        .unwrap();
    let mut peer = python_peer("cyclone_peer.py", &environment);
    peer.env("CYCLONEDDS_URI", CONFIGURATION);
    let mut peer = Peer::start(peer, "/odometry", "reliable", END);
    assert!(publisher.wait_for_subscriptions(1, PATIENCE));
    peer.matched();
    publish(&publisher, 0..BEFORE, 100.0);
    peer.await_received(BEFORE);
    peer.signal(Signal::SIGSTOP);
    // How long it is stopped: longer than the lease, and than RustDDS takes to see that it has run out.
    thread::sleep(2 * LEASE + Duration::from_secs(2));
    peer.signal(Signal::SIGCONT);
    publish(&publisher, BEFORE..END, 100.0);
    let all: Vec<_> = (0..END).collect();
    assert_eq!(peer.numbers(END, PATIENCE), all);
}

/// Of one that has ended nothing says that it goes on.
#[test]
fn a_subscription_that_was_killed_is_noticed_when_its_lease_has_run_out() {
    let environment = isolated();
    let publisher = node("sender", &environment)
        .publisher::<Odometry>("/odometry", &Qos::reliable(DEPTH))
        .unwrap();
    let mut peer = Peer::subscribe(&environment, "/odometry", "reliable", 1);
    assert!(publisher.wait_for_subscriptions(1, PATIENCE));
    peer.matched();
    peer.process.kill().unwrap();
    let start = Instant::now();
    while publisher.matched_subscriptions() > 0 {
        assert!(start.elapsed() < 2 * PATIENCE, "still there");
        thread::sleep(Duration::from_millis(50));
    }
}
