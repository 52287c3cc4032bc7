//! Endpoints that cannot work together, and the names of those who have them.

use std::{
    io::{self, Write},
    sync::{Mutex, OnceLock},
    thread,
    time::{Duration, Instant},
};

use crate::common::{isolated, node};
use lgvi_middleware::ros::Qos;
use lgvi_msgs::{nav_msgs::Odometry, tf2_msgs::TFMessage};

const PATIENCE: Duration = Duration::from_secs(10);

/// All that is logged in this process.
static LOG: Mutex<Vec<u8>> = Mutex::new(Vec::new());

struct Log;

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        LOG.lock().unwrap().extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn log() {
    static SET: OnceLock<()> = OnceLock::new();
    SET.get_or_init(|| {
        tracing_subscriber::fmt()
            .with_ansi(false)
            .with_max_level(tracing::Level::WARN)
            .with_writer(|| Log)
            .init();
    });
}

/// How often a line that ends so was logged.
fn logged(line: &str) -> usize {
    let log = String::from_utf8(LOG.lock().unwrap().clone()).unwrap();
    log.lines().filter(|logged| logged.ends_with(line)).count()
}

fn wait_until(condition: impl Fn() -> bool) -> bool {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        if condition() {
            return true;
        }
        thread::sleep(Duration::from_millis(5));
    }
    false
}

#[test]
fn incompatible_reliability_is_named_on_both_sides() {
    log();
    let environment = isolated();
    let talker = node("talker", &environment);
    let publisher = talker
        .publisher::<Odometry>("/odometry", &Qos::sensor(1))
        .unwrap();
    let listener = node("listener", &environment);
    let subscription = listener
        .subscription::<Odometry>("/odometry", &Qos::reliable(1))
        .unwrap();
    assert!(wait_until(|| {
        (publisher.incompatible(), subscription.incompatible()) == (1, 1)
    }));
    let expected = [
        "subscription of /listener on /odometry requests reliability RELIABLE, offered is BEST_EFFORT: no messages \
         will be delivered",
        "publisher of /talker on /odometry offers reliability BEST_EFFORT, requested is RELIABLE: no messages will be \
         delivered",
    ];
    assert!(wait_until(|| expected.iter().all(|line| logged(line) > 0)));
    drop(subscription);
    assert!(wait_until(|| publisher.incompatible() == 0));
    for line in expected {
        assert_eq!(logged(line), 1, "{line}");
    }
}

#[test]
fn incompatible_durability_is_named() {
    log();
    let environment = isolated();
    let publisher = node("volatile", &environment)
        .publisher::<Odometry>("/kept", &Qos::sensor(1))
        .unwrap();
    let subscription = node("latched", &environment)
        .subscription::<Odometry>("/kept", &Qos::latched(1))
        .unwrap();
    assert!(wait_until(|| logged(
        "subscription of /latched on /kept requests durability TRANSIENT_LOCAL, offered is VOLATILE: no messages will \
         be delivered"
    ) == 1));
    assert_eq!(publisher.incompatible(), 1);
    drop(subscription);
}

#[test]
fn different_types_are_named_on_both_sides() {
    log();
    let environment = isolated();
    let sender = node("sender", &environment);
    let publisher = sender
        .publisher::<Odometry>("/typed", &Qos::reliable(1))
        .unwrap();
    let receiver = node("receiver", &environment);
    let subscription = receiver
        .subscription::<TFMessage>("/typed", &Qos::reliable(1))
        .unwrap();
    let right = receiver
        .subscription::<Odometry>("/typed", &Qos::reliable(1))
        .unwrap();
    let expected = [
        "subscription of /receiver on /typed has the type tf2_msgs/msg/TFMessage, ours is nav_msgs/msg/Odometry: no \
         messages can be understood",
        "publisher of /sender on /typed has the type nav_msgs/msg/Odometry, ours is tf2_msgs/msg/TFMessage: no \
         messages can be understood",
    ];
    assert!(wait_until(|| expected.iter().all(|line| logged(line) == 1)));
    assert!(right.wait_for_publishers(1, PATIENCE));
    assert_eq!(
        (
            publisher.incompatible(),
            subscription.incompatible(),
            right.incompatible()
        ),
        (1, 1, 0)
    );
}

#[test]
fn other_nodes_come_and_go_and_may_have_the_same_name() {
    let environment = isolated();
    let one = node("one", &environment);
    let other = node("other", &environment);
    let twin = node("other", &environment);
    assert!(wait_until(|| one.other_nodes() == ["/other", "/other"]));
    assert!(wait_until(|| other.other_nodes() == ["/one", "/other"]));
    drop(twin);
    assert!(wait_until(|| one.other_nodes() == ["/other"]));
    drop(other);
    assert!(wait_until(|| one.other_nodes().is_empty()));
}
