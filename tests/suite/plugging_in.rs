//! The programs of `examples/`, against the nodes that they are written for.

use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use lgvi_middleware::ros::Qos;
use lgvi_msgs::diagnostic_msgs::DiagnosticArray;
use lgvi_msgs::geometry_msgs::{InertiaStamped, PointStamped, Vector3, Vector3Stamped};
use lgvi_msgs::msg::{BodyState, ControlSequence, SystemState};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::sensor_msgs::{Imu, JointState};
use lgvi_msgs::std_msgs::Header;
use lgvi_tests::{Process, Recording, Summary, World, binary, eventually, fast_dds, root, scene};
use serde::Deserialize;

const ODOMETRY: &str = "/lgvi_propagator/odometry/spacecraft";
const STATE: &str = "/lgvi_propagator/state";

/// A real-time factor at which the inclination change takes nine seconds: Fast DDS may need some to find a publisher of
/// RustDDS, which keeps all for it meanwhile.
const SLOW: &str = "0.1";

/// A program of `examples/`.
fn example(path: &str) -> String {
    let path = root().join("examples").join(path);
    path.into_os_string().into_string().unwrap()
}

/// Waits until a flight has ended with nothing lost; returns its bag.
#[track_caller]
fn flown(flight: Process, bag: &Path) -> Recording {
    let summary: Summary = flight.finish().expect(0).json();
    assert_eq!(summary.lost, Some(0), "messages lost");
    Recording::read(bag)
}

/// What a program has printed: a line of numbers a message, behind the time.
fn numbers(process: Process) -> Vec<(String, Vec<f64>)> {
    let output = process.finish().expect(0).stdout;
    output
        .lines()
        .map(|line| {
            let mut words = line.split_whitespace();
            let time = words.next().unwrap().to_owned();
            (time, words.map(|word| word.parse().unwrap()).collect())
        })
        .collect()
}

fn time(header: &Header) -> String {
    format!("{}.{:09}", header.stamp.sec, header.stamp.nanosec)
}

fn array(Vector3 { x, y, z }: &Vector3) -> [f64; 3] {
    [*x, *y, *z]
}

/// Torque of −½ ω on principal moments of 1, 2 and 3 kg m², for 100 s.
#[test]
fn a_python_program_on_cyclone_dds_stops_the_rotation_in_lockstep() {
    let world = World::new();
    let arguments = ["--await-wrench", "body", "--control-period", "0.1"];
    let flight = world.start_flight(&scene("free_body"), "flight", &arguments);
    let mut printed = numbers(world.python(&example("python_dds/detumble.py"), &[]));
    let bag = flown(flight, &world.path("flight"));
    let odometry = bag.messages::<Odometry>("/lgvi_propagator/odometry/body");
    let seconds = odometry
        .iter()
        .filter(|sample| sample.header.stamp.nanosec == 0);
    let mut expected: Vec<_> = seconds
        .map(|sample| {
            let rate = array(&sample.twist.twist.angular);
            (sample.header.stamp.sec.to_string(), rate.to_vec())
        })
        .collect();
    // The first is published until it is answered.
    expected.dedup();
    printed.dedup();
    assert_eq!(expected.len(), 101);
    assert_eq!(printed, expected);
    stopped(&world, &bag);
}

/// The rotation has been stopped by a wrench every 0.1 s for 100 s.
fn stopped(world: &World, bag: &Recording) {
    let sequences = bag.messages::<ControlSequence>("/lgvi_propagator/flown_control");
    assert_eq!(sequences.len(), 1000);
    let state = bag.messages::<SystemState>(STATE);
    let last = state.iter().max_by_key(|state| state.step).unwrap();
    let spin = last.bodies[0].angular_momentum.map(f64::abs);
    assert!(
        spin.into_iter().all(|component| component < 1e-6),
        "{spin:?}"
    );
    world.verify_agrees(&world.path("flight"), 10_001);
}

/// A line of `read_states.py`.
#[derive(Debug, Deserialize)]
struct State {
    sequence: u64,
    step: u64,
    time: f64,
    bodies: Vec<Body>,
}

#[derive(Debug, Deserialize)]
struct Body {
    name: String,
    position: [f64; 3],
    linear_momentum: [f64; 3],
    attitude: [f64; 9],
    angular_momentum: [f64; 3],
}

/// The bits of a body's numbers.
fn bits(body: &BodyState) -> Vec<u64> {
    let vectors = [body.position, body.linear_momentum, body.angular_momentum];
    let numbers = vectors.as_flattened().iter().chain(&body.attitude);
    numbers.map(|number| number.to_bits()).collect()
}

#[test]
fn a_python_program_reads_every_state_from_shared_memory_bit_for_bit() {
    let world = World::new();
    let reader = world.python(&example("python_shared_memory/read_states.py"), &[]);
    reader.await_stderr("listening");
    let (_, bag) = world.fly(&scene("two_dumbbells"), "flight");
    let output = reader.finish().expect(0).stdout;
    let recorded = Recording::read(&bag).messages::<SystemState>(STATE);
    assert_eq!(recorded.len(), 15001);
    assert_eq!(output.lines().count(), recorded.len());
    for (line, expected) in output.lines().zip(recorded) {
        let found: State = serde_json::from_str(line).unwrap();
        assert_eq!(
            (found.sequence, found.step, found.time.to_bits()),
            (expected.sequence, expected.step, expected.time.to_bits())
        );
        assert_eq!(found.bodies.len(), 2);
        for (found, expected) in found.bodies.into_iter().zip(&expected.bodies) {
            let found = BodyState {
                name: found.name,
                position: found.position,
                linear_momentum: found.linear_momentum,
                attitude: found.attitude,
                angular_momentum: found.angular_momentum,
            };
            assert_eq!(found.name, expected.name);
            assert_eq!(bits(&found), bits(expected), "step {}", line);
        }
    }
}

#[test]
fn a_cpp_program_on_fast_dds_sees_every_odometry() {
    let world = World::new();
    let program = fast_dds("examples/cpp_fast_dds/watch_odometry.cpp");
    let mut command = world.command(&program);
    command.arg("101");
    let watcher = world.start("watch_odometry", command);
    watcher.await_stderr("listening");
    let arguments = ["--real-time-factor", SLOW];
    let flight = world.start_flight(&scene("inclination_change"), "flight", &arguments);
    let bag = flown(flight, &world.path("flight"));
    let expected: Vec<_> = bag
        .messages::<Odometry>(ODOMETRY)
        .iter()
        .map(|odometry| {
            let position = &odometry.pose.pose.position;
            let rate = array(&odometry.twist.twist.angular);
            let line = [[position.x, position.y, position.z], rate].concat();
            (time(&odometry.header), line)
        })
        .collect();
    assert_eq!(expected.len(), 101);
    assert_eq!(numbers(watcher), expected);
}

#[test]
fn a_node_on_rclpy_follows_the_odometry_and_publishes() {
    let world = World::new();
    let listener = world.ros_node("listener");
    let normals = listener
        .subscription::<Vector3Stamped>("/orbit_normal/normal", &Qos::reliable(1000))
        .unwrap();
    let node = world.ros_python(&example("python_ros/orbit_normal.py"), &[]);
    eventually("the node's publisher", || {
        (normals.matched_publishers() > 0).then_some(())
    });
    let arguments = ["--real-time-factor", SLOW];
    let flight = world.start_flight(&scene("inclination_change"), "flight", &arguments);
    let bag = flown(flight, &world.path("flight"));

    let odometry = bag.messages::<Odometry>(ODOMETRY);
    let mut states = bag.messages::<SystemState>(STATE);
    states.retain(|state| state.step % 10 == 0);
    assert_eq!((states.len(), odometry.len()), (101, 101));
    let mut inclinations = Vec::new();
    for (state, odometry) in states.iter().zip(&odometry) {
        let sample = eventually("a normal for each odometry", || normals.take().unwrap());
        assert_eq!(sample.message.header, odometry.header);
        let normal = array(&sample.message.vector);
        let dot = |vector: [f64; 3]| vector.iter().zip(normal).map(|(v, n)| v * n).sum::<f64>();
        let body = &state.bodies[0];
        assert!(dot(body.position).abs() < 1e-14 && dot(body.linear_momentum).abs() < 1e-14);
        assert!((dot(normal) - 1.0).abs() < 1e-14);
        inclinations.push(normal[2].acos().to_degrees());
    }
    assert!(inclinations[0].abs() < 1e-6 && (inclinations[100] - 60.0).abs() < 1e-9);
    node.stop().expect(0);
}

/// Torque of −½ ω on principal moments of 1, 2 and 3 kg m², for 100 s.
#[test]
fn a_controller_on_rclpy_stops_the_rotation_in_lockstep() {
    let world = World::new();
    let node = world.ros_python(&example("python_ros/detumble_live.py"), &[]);
    let arguments = ["--await-wrench", "body", "--control-period", "0.1"];
    let flight = world.start_flight(&scene("free_body"), "flight", &arguments);
    let bag = flown(flight, &world.path("flight"));
    node.stop().expect(0);
    stopped(&world, &bag);
}

/// A quarter turn about y has been made. The second wheel saturates on the way.
fn slewed(world: &World, bag: &Recording) {
    let state = bag.messages::<SystemState>(STATE);
    let last = state.iter().max_by_key(|state| state.step).unwrap();
    let quarter = [0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0];
    let miss = last.bodies[0].attitude.iter().zip(quarter);
    let miss = miss.map(|(found, expected)| (found - expected).abs());
    let miss = miss.fold(0.0, f64::max);
    assert!(miss < 0.02, "{miss}: {last:?}");
    let joints = bag.messages::<JointState>("/lgvi_propagator/joint_states/satellite");
    let speeds = joints.iter().map(|state| state.velocity[1].abs());
    let most = speeds.fold(0.0, f64::max);
    assert!(most > 599.0 && most < 601.0, "{most}");
    world.verify_agrees(&world.path("flight"), 6001);
}

#[test]
fn a_controller_on_rclpy_turns_a_satellite_by_its_wheels() {
    let world = World::new();
    let node = world.ros_python(&example("python_ros/wheel_slew.py"), &[]);
    let arguments = ["--await-wheels", "satellite", "--control-period", "0.1"];
    let flight = world.start_flight(&scene("wheel_slew"), "flight", &arguments);
    let bag = flown(flight, &world.path("flight"));
    node.stop().expect(0);
    slewed(&world, &bag);
}

#[test]
fn a_controller_on_rclpy_approaches_a_station_by_thrusters() {
    let world = World::new();
    let node = world.ros_python(&example("python_ros/thruster_approach.py"), &[]);
    let arguments = ["--await-thrust", "chaser", "--control-period", "0.5"];
    let flight = world.start_flight(&scene("thruster_approach"), "flight", &arguments);
    let bag = flown(flight, &world.path("flight"));
    node.stop().expect(0);
    let state = bag.messages::<SystemState>(STATE);
    let last = state.iter().max_by_key(|state| state.step).unwrap();
    let [station, chaser] = &*last.bodies else {
        panic!("{last:?}")
    };
    let apart = |axis: usize| chaser.position[axis] - station.position[axis];
    let distance = (0..3).map(|axis| apart(axis).powi(2)).sum::<f64>().sqrt();
    assert!((distance - 6.0).abs() < 1.0, "{distance}");
    let inertias = bag.messages::<InertiaStamped>("/lgvi_propagator/inertia/chaser");
    let masses: Vec<_> = inertias.iter().map(|one| one.inertia.m).collect();
    let used = masses[0] - masses[masses.len() - 1];
    assert!(used > 0.03 && used < 0.2, "{used}");
    world.verify_agrees(&world.path("flight"), 6001);
}

/// Flies with the controller in Rust, with these arguments, which begins after the flight by this time.
fn slew_in_rust(world: &World, arguments: &[&str], late: Duration) -> Recording {
    let mut command = world.command(&binary("examples/wheel_controller"));
    command.args(arguments);
    let awaits = ["--await-wheels", "satellite"];
    let flight = world.start_flight(&scene("wheel_slew"), "flight", &awaits);
    sleep(late);
    let node = world.start("wheel_controller", command);
    let bag = flown(flight, &world.path("flight"));
    node.stop().expect(0);
    slewed(world, &bag);
    let gyro = bag.messages::<Imu>("/lgvi_propagator/imu/satellite/gyro");
    // The first reading comes again while the controller is waited for.
    assert!((6001..6010).contains(&gyro.len()), "{}", gyro.len());
    let flown = bag.messages::<ControlSequence>("/lgvi_propagator/flown_control");
    assert_eq!(flown.len(), 6000);
    bag
}

#[test]
fn a_controller_in_rust_turns_a_satellite_by_its_wheels() {
    let world = World::new();
    let bag = slew_in_rust(&world, &[], Duration::ZERO);
    let odometry = bag.messages::<Odometry>("/lgvi_propagator/odometry/satellite");
    assert!(odometry.len() >= 6001, "{}", odometry.len());
}

/// What goes over ROS 2 is then as often as the scene says.
#[test]
fn a_controller_in_rust_turns_a_satellite_over_shared_memory() {
    let world = World::new();
    let arguments = ["--ros-args", "-p", "shared_memory:=true"];
    let bag = slew_in_rust(&world, &arguments, Duration::from_secs(2));
    let odometry = bag.messages::<Odometry>("/lgvi_propagator/odometry/satellite");
    assert!((601..700).contains(&odometry.len()), "{}", odometry.len());
}

#[test]
fn a_rust_node_of_ones_own_follows_the_state_and_publishes() {
    let world = World::new();
    let listener = world.ros_node("listener");
    let positions = listener
        .subscription::<PointStamped>("/chase/view/position", &Qos::reliable(1000))
        .unwrap();
    let mut command = world.command(&binary("examples/own_node"));
    command.args(["--ros-args", "-r", "__ns:=/chase", "-r", "__node:=view"]);
    command.args(["-r", "~/state:=/lgvi_propagator/state"]);
    command.args(["-p", "observer:=dumbbell2", "-p", "target:=dumbbell1"]);
    let node = world.start("own_node", command);
    eventually("the node's publisher", || {
        (positions.matched_publishers() > 0).then_some(())
    });
    let arguments = ["--real-time-factor", "10"];
    let flight = world.start_flight(&scene("two_dumbbells"), "flight", &arguments);
    let bag = flown(flight, &world.path("flight"));

    let mut states = bag.messages::<SystemState>(STATE);
    states.retain(|state| state.step % 50 == 0);
    assert_eq!(states.len(), 301);
    for state in &states {
        let sample = eventually("a position for each state", || positions.take().unwrap());
        let PointStamped { header, point } = sample.message;
        assert_eq!(header.stamp, state.header.stamp);
        assert_eq!(header.frame_id, "dumbbell2");
        // Turned back into the inertial frame, it leads from the observer to the target.
        let [target, observer] = &*state.bodies else {
            panic!("{state:?}")
        };
        for axis in 0..3 {
            let row = &observer.attitude[3 * axis..];
            let turned = row[0] * point.x + row[1] * point.y + row[2] * point.z;
            let reached = observer.position[axis] + turned;
            assert!(
                (reached - target.position[axis]).abs() < 1e-14,
                "{state:?} {point:?}"
            );
        }
    }
    node.stop().expect(0);
}

#[test]
fn a_rust_node_of_ones_own_is_managed_and_diagnosed() {
    let world = World::new();
    let observer = world.ros_node("observer");
    let diagnostics = observer
        .subscription::<DiagnosticArray>("/diagnostics", &Qos::reliable(100))
        .unwrap();
    let mut command = world.command(&binary("examples/own_node"));
    command.args(["--ros-args", "-p", "autostart:=false"]);
    let node = world.start("own_node", command);
    let operator = world.operator("own_node");
    assert_eq!(operator.state(), "unconfigured");
    operator.set_text("observer", "moon").unwrap();
    operator.lead(&["configure", "activate"]);
    let published = eventually("its diagnostics", || {
        let array = diagnostics.take().unwrap()?.message;
        let mut values = array.status.into_iter().flat_map(|status| status.values);
        values.find(|value| value.key == "published")
    });
    assert_eq!(published.value, "0");

    // The scene has no moon: the error is reported, and a manager can put it right.
    let states = observer
        .publisher::<SystemState>("/own_node/state", &Qos::latched(1000))
        .unwrap();
    let bodies = ["dumbbell1", "dumbbell2"].map(|name| BodyState {
        name: name.into(),
        ..BodyState::default()
    });
    let state = SystemState {
        bodies: bodies.into(),
        ..SystemState::default()
    };
    states.publish(&state).unwrap();
    operator.await_state("unconfigured");
    node.await_stderr("the scene has no body \"moon\"");
    operator.set_text("observer", "dumbbell1").unwrap();
    operator.lead(&["configure", "activate", "deactivate", "cleanup", "shutdown"]);
    node.stop().expect(0);
}
