//! Sensors of a flight: heard by a controller that knows nothing else, recorded, and repeated.

use std::fs;
use std::path::{Path, PathBuf};

use lgvi_middleware::ros::Qos;
use lgvi_msgs::geometry_msgs::{Quaternion, Vector3, Wrench, WrenchStamped};
use lgvi_msgs::msg::SystemState;
use lgvi_msgs::sensor_msgs::Imu;
use lgvi_msgs::stamp;
use lgvi_tests::{PATIENCE, Recording, World, edited, eventually};

const IMU: &str = "/lgvi_propagator/imu/body/gyro";
const STARS: &str = "/lgvi_propagator/star_tracker/body/stars";

/// Steps of the flights, of 0.01 s.
const STEPS: u64 = 300;

const SENSORS: &str = r#"
[[bodies.sensors]]
name = "gyro"
kind = "imu"
frame = "board"
period = 0.02
gyroscope = { noise_density = 1e-4, bias_instability = 1e-3, correlation_time = 10.0 }
accelerometer = { noise_density = 1e-3 }

[[bodies.sensors]]
name = "stars"
kind = "star_tracker"
period = 0.1
delay = 0.05
cross_boresight = "10 arcsec"
about_boresight = "1 arcmin"

[[frames]]
name = "board"
parent = "body"
position = [0.0, 0.5, 0.0]
"#;

/// `scenes/free_body.toml` with fewer steps, and sensors.
fn scene(world: &World) -> PathBuf {
    let changes = [
        ("duration = 100.0", "duration = 3.0"),
        ("steps = 10000", "steps = 300"),
    ];
    let path = edited(world, "free_body", &changes);
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text + SENSORS).unwrap();
    path
}

/// Flies with a controller that hears the IMU alone and brakes the rotation, and records these topics.
fn fly(world: &World, bag: &str, topics: &[&str]) -> PathBuf {
    let bag = world.path(bag);
    let output = format!("output:={}", bag.display());
    let own = [
        "/lgvi_propagator/scene=lgvi_msgs/msg/Scene",
        "/lgvi_propagator/flown_control=lgvi_msgs/msg/ControlSequence",
        "/lgvi_propagator/intervention=lgvi_msgs/msg/Intervention",
    ];
    let topics = topics
        .iter()
        .map(|topic| format!("{topic}=sensor_msgs/msg/Imu"));
    let topics: Vec<_> = own.into_iter().map(str::to_owned).chain(topics).collect();
    let topics = format!("topics:=['{}']", topics.join("', '"));
    let recorder = world.node("recorder", &[&output, &topics, "log_time:=stamp"]);
    recorder.await_ready();
    let scene = format!("scene:={}", scene(world).display());
    let propagator = world.node(
        "propagator",
        &[
            "autostart:=false",
            &scene,
            "real_time_factor:=0.0",
            "await_wrench:=[body]",
            "control_period:=0.1",
        ],
    );
    let operator = world.operator("lgvi_propagator");
    operator.lead(&["configure"]);
    let ros = operator.ros();
    let imu = ros.subscription::<Imu>(IMU, &Qos::reliable(1000)).unwrap();
    let wrench = ros
        .publisher::<WrenchStamped>("/lgvi_propagator/wrench/body", &Qos::reliable(10))
        .unwrap();
    eventually("the propagator's topics", || {
        (imu.matched_publishers() > 0 && wrench.matched_subscriptions() > 0).then_some(())
    });
    operator.lead(&["activate"]);
    // Of the step at which the flight waits: each tenth.
    let mut stamps = Vec::new();
    while stamps.len() < 30 {
        let received = imu.recv_timeout(PATIENCE).unwrap().expect("a measurement");
        let Imu {
            header,
            angular_velocity: rate,
            ..
        } = received.message;
        let now = stamp::from_message(&header.stamp).unwrap();
        let start = *stamps.first().unwrap_or(&now);
        if (now - start) % 100_000_000 != 0 || stamps.last() == Some(&now) {
            continue;
        }
        stamps.push(now);
        let command = WrenchStamped {
            header,
            wrench: Wrench {
                force: Vector3 {
                    x: 0.2,
                    ..Default::default()
                },
                torque: Vector3 {
                    x: -rate.x,
                    y: -rate.y,
                    z: -rate.z,
                },
            },
        };
        wrench.publish(&command).unwrap();
    }
    propagator.await_flown();
    propagator.stop().expect(0);
    recorder.stop().expect(0);
    bag
}

/// By their stamps, each once: the first may be repeated for who has come late.
fn recorded(bag: &Path, topic: &str) -> Vec<Imu> {
    let mut all = Recording::read(bag).messages::<Imu>(topic);
    all.sort_by_key(|imu| (imu.header.stamp.sec, imu.header.stamp.nanosec));
    all.dedup();
    all
}

fn states(bag: &Path) -> Vec<SystemState> {
    let mut states = Recording::read(bag).messages::<SystemState>("/lgvi_propagator/state");
    states.sort_by_key(|state| state.step);
    states
}

#[test]
fn a_controller_flies_on_an_imu_alone_and_gets_the_same_bits_whoever_else_listens() {
    let world = World::new();
    let alone = fly(&world, "alone", &[]);
    let watched = fly(&world, "watched", &[IMU, STARS]);
    let (one, other) = (states(&alone), states(&watched));
    let bodies = |states: &[SystemState]| -> Vec<_> {
        states.iter().map(|state| state.bodies.clone()).collect()
    };
    assert_eq!(one.len() as u64, STEPS + 1);
    assert!(bodies(&one) == bodies(&other), "the flights differ");
    for bag in [&alone, &watched] {
        world.verify_agrees(bag, STEPS + 1);
    }

    let imu = recorded(&watched, IMU);
    let times = |all: &[Imu]| -> Vec<i64> {
        let all = all.iter().map(|imu| stamp::from_message(&imu.header.stamp));
        all.collect::<Result<_, _>>().unwrap()
    };
    let start = times(&imu)[0];
    let expected: Vec<i64> = (0..=STEPS / 2)
        .map(|k| start + k as i64 * 20_000_000)
        .collect();
    assert_eq!(times(&imu), expected);
    assert_eq!(imu[0].header.frame_id, "board");
    assert_eq!(imu[0].orientation_covariance[0], -1.0);
    // The rotation is braked, and the thrust is felt at the end.
    let last = imu.last().unwrap();
    let rate = &last.angular_velocity;
    let first = &imu[0].angular_velocity;
    assert!(rate.x.hypot(rate.y).hypot(rate.z) < 0.6 * first.x.hypot(first.y).hypot(first.z));

    let stars = recorded(&watched, STARS);
    // One that is 0.05 s late comes after the end of the flight.
    let expected: Vec<i64> = (0..30).map(|k| start + k * 100_000_000).collect();
    assert_eq!(times(&stars), expected);
    for (measured, state) in stars.iter().zip(other.iter().step_by(10)) {
        let Quaternion { x, y, z, w } = measured.orientation;
        let [r00, _, _, _, r11, _, _, _, r22] = state.bodies[0].attitude;
        // 1 arcmin is 3e-4 rad.
        for (found, expected) in [
            (1.0 - 2.0 * (y * y + z * z), r00),
            (1.0 - 2.0 * (x * x + z * z), r11),
            (1.0 - 2.0 * (x * x + y * y), r22),
        ] {
            assert!((found - expected).abs() < 2e-3, "{found} for {expected}");
        }
        assert_ne!(w, 0.0);
    }
}
