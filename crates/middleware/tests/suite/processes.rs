//! A publisher on DDS and a subscription in another process.

use std::{
    env,
    io::{BufRead, BufReader, Lines},
    process::{Child, ChildStdout, Command, Stdio},
    time::{Duration, Instant},
};

use crate::common::{isolated, node};
use lgvi_middleware::{Environment, ros::Qos};
use lgvi_msgs::nav_msgs::Odometry;
use nix::{
    sys::signal::{Signal, kill},
    unistd::Pid,
};

const PATIENCE: Duration = Duration::from_secs(20);

fn odometry(x: f64) -> Odometry {
    let mut odometry = Odometry::default();
    odometry.header.frame_id = "inertial".into();
    odometry.child_frame_id = "chaser".into();
    odometry.pose.pose.position.x = x;
    odometry
}

/// Subscribes to odometry in another process, and prints how many messages came in order.
struct Listener {
    process: Child,
    lines: Lines<BufReader<ChildStdout>>,
}

const DOMAIN: &str = "LGVI_TEST_DOMAIN";
const COUNT: &str = "LGVI_TEST_COUNT";

impl Listener {
    fn spawn(environment: &Environment, count: u32) -> Self {
        let mut process = Command::new(env::current_exe().unwrap())
            .args(["--exact", "processes::listener", "--ignored", "--nocapture"])
            .env(DOMAIN, environment.domain_id.to_string())
            .env(COUNT, count.to_string())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(process.stdout.take().unwrap()).lines();
        Self { process, lines }
    }

    fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.process.id().try_into().unwrap()), signal).unwrap();
    }

    fn received(&mut self) -> String {
        self.lines
            .by_ref()
            .map(Result::unwrap)
            .find_map(|line| Some(line.split_once("received ")?.1.to_owned()))
            .unwrap()
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        self.process.wait().unwrap();
    }
}

#[test]
#[ignore = "run by other tests in a process of its own"]
#[allow(clippy::print_stdout)]
fn listener() {
    let environment = Environment::localhost(env::var(DOMAIN).unwrap().parse().unwrap());
    let count: u32 = env::var(COUNT).unwrap().parse().unwrap();
    let node = node("listener", &environment);
    let subscription = node
        .subscription::<Odometry>("/odometry", &Qos::reliable(count as usize))
        .unwrap();
    let _other = node
        .subscription::<Odometry>("/other", &Qos::reliable(1))
        .unwrap();
    for index in 0..count {
        let sample = subscription.recv_timeout(PATIENCE).unwrap();
        let x = sample.unwrap().message.pose.pose.position.x;
        assert_eq!(x, f64::from(index));
    }
    println!("received {count}, lost {}", subscription.lost());
}

#[test]
fn a_burst_reaches_another_process_though_its_publisher_leaves_at_once() {
    const COUNT: u32 = 20_000;
    let environment = isolated();
    let mut listener = Listener::spawn(&environment, COUNT);
    let publisher = node("sender", &environment)
        .publisher("/odometry", &Qos::reliable(1))
        .unwrap();
    assert!(publisher.wait_for_subscriptions(1, PATIENCE));
    for index in 0..COUNT {
        publisher
            .publish_lossless(&odometry(f64::from(index)), PATIENCE)
            .unwrap();
    }
    drop(publisher);
    assert_eq!(listener.received(), format!("{COUNT}, lost 0"));
}

#[test]
fn a_process_that_hangs_costs_one_wait() {
    const COUNT: u32 = 2000;
    let environment = isolated();
    let listener = Listener::spawn(&environment, 1_000_000);
    let limit = Duration::from_secs(1);
    let node = node("sender", &environment);
    let publishers = ["/odometry", "/other"].map(|topic| {
        let publisher = node.publisher(topic, &Qos::reliable(1)).unwrap();
        assert!(publisher.wait_for_subscriptions(1, PATIENCE));
        publisher.publish(&odometry(0.0)).unwrap();
        publisher.flush(PATIENCE).unwrap();
        publisher
    });
    listener.signal(Signal::SIGSTOP);
    let start = Instant::now();
    for index in 1..COUNT {
        for publisher in &publishers {
            publisher
                .publish_lossless(&odometry(f64::from(index)), limit)
                .unwrap();
        }
    }
    // One wait for both, and 20 ms once in half a window of 512.
    let elapsed = start.elapsed();
    assert!(elapsed >= limit && elapsed < 2 * limit, "{elapsed:?}");
    for publisher in &publishers {
        assert_eq!((publisher.sent(), publisher.dropped()), (COUNT.into(), 0));
    }
}
