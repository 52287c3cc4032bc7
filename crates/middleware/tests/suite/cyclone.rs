//! A participant of another make: `tests/python/cyclone_peer.py`, on Cyclone DDS.
//!
//! Needs a Python with PyPI `cyclonedds` 11.0.1: `target/python-env`, or what `LGVI_PYTHON` names.

use std::{
    io::{BufRead, BufReader, Read, Write},
    process::{Child, Stdio},
    time::Duration,
};

use crate::common::{isolated, node, python_peer};
use lgvi_middleware::{Environment, ros::Qos};
use lgvi_msgs::{
    geometry_msgs::{TransformStamped, Vector3},
    msg::ControlSequence,
    nav_msgs::Odometry,
    tf2_msgs::TFMessage,
};
use serde_json::{Value, json};

const PATIENCE: Duration = Duration::from_secs(20);

fn peer(environment: &Environment, args: &[&str]) -> Child {
    python_peer("cyclone_peer.py", environment)
        .args(["--timeout", &PATIENCE.as_secs().to_string()])
        .args(args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Waits until the peer says that it has found its counterpart.
fn matched(peer: &mut Child) {
    let mut line = String::new();
    BufReader::new(peer.stderr.as_mut().unwrap())
        .read_line(&mut line)
        .unwrap();
    assert_eq!(line.trim(), "matched");
}

fn printed(mut peer: Child) -> Vec<Value> {
    let mut text = String::new();
    peer.stdout
        .take()
        .unwrap()
        .read_to_string(&mut text)
        .unwrap();
    let mut complaint = String::new();
    peer.stderr
        .take()
        .unwrap()
        .read_to_string(&mut complaint)
        .unwrap();
    assert!(peer.wait().unwrap().success(), "{complaint}");
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

fn vector(x: f64, y: f64, z: f64) -> Vector3 {
    Vector3 { x, y, z }
}

#[test]
fn odometry_is_read_as_it_was_written() {
    const COUNT: u32 = 2000;
    let environment = isolated();
    let node = node("lgvi_propagator", &environment);
    let publisher = node
        .publisher("~/odometry/chaser", &Qos::reliable(1))
        .unwrap();
    let topic = "/lgvi_propagator/odometry/chaser";
    let mut peer = peer(
        &environment,
        &["--odometry", topic, "--count", &COUNT.to_string()],
    );
    assert!(publisher.wait_for_subscriptions(1, PATIENCE));
    matched(&mut peer);
    let message = |index: u32| {
        let mut message = Odometry::default();
        message.header.stamp.sec = 7;
        message.header.stamp.nanosec = index;
        // Lengths that leave the doubles after them at every alignment.
        message.header.frame_id = "i".repeat(index as usize % 9);
        message.child_frame_id = "chaser".into();
        message.pose.pose.position.x = f64::from(index) / 3.0;
        message.pose.pose.orientation.w = -0.5;
        message.pose.covariance[35] = 36.0;
        message.twist.twist.angular.z = 1e-300;
        message.twist.covariance[0] = 0.25;
        message
    };
    for index in 0..COUNT {
        publisher
            .publish_lossless(&message(index), PATIENCE)
            .unwrap();
    }
    publisher.flush(PATIENCE).unwrap();
    let samples = printed(peer);
    assert_eq!(samples.len(), COUNT as usize);
    for (index, sample) in (0..).zip(&samples) {
        let message = message(index);
        assert_eq!(
            sample["header"]["stamp"],
            json!({"sec": 7, "nanosec": index})
        );
        assert_eq!(sample["header"]["frame_id"], json!(message.header.frame_id));
        assert_eq!(sample["child_frame_id"], "chaser");
        assert_eq!(
            sample["pose"]["pose"]["position"]["x"],
            f64::from(index) / 3.0
        );
        assert_eq!(sample["pose"]["pose"]["orientation"]["w"], -0.5);
        assert_eq!(sample["pose"]["covariance"][35], 36.0);
        assert_eq!(sample["twist"]["twist"]["angular"]["z"], 1e-300);
        assert_eq!(sample["twist"]["covariance"][0], 0.25);
    }
}

#[test]
fn transforms_reach_a_best_effort_reader_and_late_latched_one() {
    let environment = isolated();
    let node = node("lgvi_propagator", &environment);
    let publisher = node.publisher("/tf", &Qos::latched(1)).unwrap();
    let mut transform = TransformStamped::default();
    transform.header.frame_id = "inertial".into();
    transform.child_frame_id = "b".into();
    transform.transform.translation = vector(1.0, 2.0, 3.0);
    let message = TFMessage {
        transforms: vec![transform.clone(), transform],
    };
    publisher.publish(&message).unwrap();
    let check = |samples: Vec<Value>| {
        assert_eq!(samples.len(), 1);
        assert_eq!(samples[0]["transforms"].as_array().unwrap().len(), 2);
        assert_eq!(
            samples[0]["transforms"][1]["transform"]["translation"],
            json!({"x": 1.0, "y": 2.0, "z": 3.0})
        );
    };
    check(printed(peer(
        &environment,
        &["--tf", "/tf", "--qos", "latched"],
    )));

    let mut peer = peer(&environment, &["--tf", "/tf", "--qos", "best-effort"]);
    matched(&mut peer);
    assert!(publisher.wait_for_subscriptions(1, PATIENCE));
    publisher.publish(&message).unwrap();
    check(printed(peer));
}

#[test]
fn a_control_sequence_of_a_stranger_is_received() {
    let environment = isolated();
    let node = node("lgvi_propagator", &environment);
    let subscription = node
        .subscription::<ControlSequence>("~/control_sequence", &Qos::latched(1))
        .unwrap();
    let mut peer = peer(
        &environment,
        &["--send-control", "/lgvi_propagator/control_sequence"],
    );
    let control = json!({
        "header": {"stamp": {"sec": 5, "nanosec": 6}, "frame_id": "inertial"},
        "body": "chaser",
        "first_step": 1u64 << 40,
        "step_size": 0.1,
        "force": [{"x": 1.0, "y": 2.0, "z": 3.0}, {"x": 4.0, "y": 5.0, "z": 6.0}],
        "moment": [{"x": -1.0, "y": 0.0, "z": 1e-9}, {"x": 0.0, "y": 0.0, "z": 0.0}],
        "reference": [{
            "name": "chaser",
            "position": [1.0, 2.0, 3.0],
            "linear_momentum": [4.0, 5.0, 6.0],
            "attitude": [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            "angular_momentum": [7.0, 8.0, 9.0],
        }],
        "feedback": [0.5, -0.25],
        "limits": {"force": [1.0, null, 3.0], "moment": [4.0, 5.0, 6.0], "force_norm": null, "moment_norm": 7.0},
        "moment_in_frame": true,
        "wheel_torque": [0.125],
        "thrust": [1.5, 2.5],
    });
    peer.stdin
        .take()
        .unwrap()
        .write_all(control.to_string().as_bytes())
        .unwrap();
    let sample = subscription.recv_timeout(PATIENCE).unwrap().unwrap();
    assert!(peer.wait().unwrap().success());
    let message = sample.message;
    assert_eq!(
        (message.header.stamp.sec, message.header.stamp.nanosec),
        (5, 6)
    );
    assert_eq!(
        (message.header.frame_id.as_str(), message.body.as_str()),
        ("inertial", "chaser")
    );
    assert_eq!((message.first_step, message.step_size), (1 << 40, 0.1));
    assert_eq!(
        message.force,
        [vector(1.0, 2.0, 3.0), vector(4.0, 5.0, 6.0)]
    );
    assert_eq!(
        message.moment,
        [vector(-1.0, 0.0, 1e-9), vector(0.0, 0.0, 0.0)]
    );
    let [reference] = &message.reference[..] else {
        panic!("{:?}", message.reference)
    };
    assert_eq!(reference.name, "chaser");
    assert_eq!(reference.attitude[..4], [0.0, -1.0, 0.0, 1.0]);
    assert_eq!(reference.angular_momentum, [7.0, 8.0, 9.0]);
    assert_eq!(message.feedback, [0.5, -0.25]);
    assert!(message.moment_in_frame);
    assert_eq!(message.wheel_torque, [0.125]);
    assert_eq!(message.thrust, [1.5, 2.5]);
    let limits = &message.limits;
    assert_eq!(limits.force, [1.0, f64::INFINITY, 3.0]);
    assert_eq!(
        (limits.force_norm, limits.moment_norm),
        (f64::INFINITY, 7.0)
    );
    assert_eq!(subscription.take().unwrap(), None);
}
