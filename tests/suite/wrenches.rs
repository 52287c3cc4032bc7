//! Wrenches from a controller outside: in lockstep, held, over, and their record repeated.

use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use lgvi_middleware::ros::Qos;
use lgvi_msgs::geometry_msgs::{Vector3, Wrench, WrenchStamped};
use lgvi_msgs::msg::{ControlSequence, SystemState};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_tests::{Operator, PATIENCE, Process, Recording, World, edited, eventually};

const STATE: &str = "/lgvi_propagator/state";
const FLOWN: &str = "/lgvi_propagator/flown_control";

/// Scenes begin at noon of 2000-01-01 where they do not say otherwise (s).
const EPOCH: i32 = 946_728_000;

/// Steps of the flights, of 0.01 s.
const STEPS: u64 = 500;

/// `scenes/free_body.toml` with fewer steps, and a thruster.
fn free_body(world: &World) -> PathBuf {
    let thruster = "[publish]\n";
    let with = "[[frames]]\nname = \"thruster\"\nparent = \"body\"\nposition = [0.0, 0.5, 0.0]\n\n[publish]\n";
    let changes = [
        ("duration = 100.0", "duration = 5.0"),
        ("steps = 10000", "steps = 500"),
        (thruster, with),
    ];
    edited(world, "free_body", &changes)
}

/// A propagator that is recorded.
struct Flight {
    propagator: Process,
    recorder: Process,
    operator: Operator,
    bag: PathBuf,
}

impl Flight {
    /// Configured, but not active.
    fn prepare(world: &World, bag: &str, parameters: &[&str]) -> Self {
        let bag = world.path(bag);
        let output = format!("output:={}", bag.display());
        let topics = format!(
            "topics:=['/lgvi_propagator/scene=lgvi_msgs/msg/Scene', '{FLOWN}=lgvi_msgs/msg/ControlSequence', \
             '/lgvi_propagator/intervention=lgvi_msgs/msg/Intervention']"
        );
        let recorder = world.node("recorder", &[&output, &topics, "log_time:=stamp"]);
        recorder.await_ready();
        let scene = format!("scene:={}", free_body(world).display());
        let mut all = vec!["autostart:=false", &*scene];
        all.extend(parameters);
        let propagator = world.node("propagator", &all);
        let operator = world.operator("lgvi_propagator");
        operator.lead(&["configure"]);
        Self {
            propagator,
            recorder,
            operator,
            bag,
        }
    }

    /// Ends it; its bag and what the propagator has said.
    fn end(self) -> (PathBuf, String) {
        let stderr = self.propagator.stop().expect(0).stderr;
        self.recorder.stop().expect(0);
        (self.bag, stderr)
    }
}

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

/// The last recorded state.
fn last(bag: &Path) -> SystemState {
    let states = Recording::read(bag).messages::<SystemState>(STATE);
    states.into_iter().max_by_key(|state| state.step).unwrap()
}

/// Flies with a controller that slows the rotation and pushes with a thruster, and takes its time to answer.
fn fly_in_lockstep(world: &World, bag: &str, thinks: Duration) -> PathBuf {
    let parameters = [
        "real_time_factor:=0.0",
        "await_wrench:=[body]",
        "control_period:=0.1",
        "wrench_timeout:=0.1",
    ];
    let flight = Flight::prepare(world, bag, &parameters);
    let ros = flight.operator.ros();
    let odometry = ros
        .subscription::<Odometry>("/lgvi_propagator/odometry/body", &Qos::reliable(1000))
        .unwrap();
    let wrench = ros
        .publisher::<WrenchStamped>("/lgvi_propagator/wrench/body", &Qos::reliable(10))
        .unwrap();
    eventually("the propagator's topics", || {
        (odometry.matched_publishers() > 0 && wrench.matched_subscriptions() > 0).then_some(())
    });
    flight.operator.lead(&["activate"]);
    let mut answered = 0;
    while answered < STEPS / 10 {
        let message = odometry.recv_timeout(PATIENCE).unwrap();
        let Odometry {
            header,
            child_frame_id,
            twist,
            ..
        } = message.expect("odometry").message;
        sleep(thinks);
        let rate = twist.twist.angular;
        let mut command = WrenchStamped {
            header,
            wrench: Wrench {
                force: vector([0.0, 0.0, 0.0]),
                torque: vector([-rate.x, -2.0 * rate.y, -3.0 * rate.z]),
            },
        };
        command.header.frame_id = child_frame_id;
        if answered >= 25 {
            // Off the center: it turns the body, too.
            command.header.frame_id = "thruster".into();
            command.wrench = Wrench {
                force: vector([0.1, 0.0, 0.0]),
                torque: Vector3::default(),
            };
        }
        wrench.publish(&command).unwrap();
        answered += 1;
    }
    flight.propagator.await_flown();
    flight.end().0
}

#[test]
fn in_lockstep_a_slow_controller_flies_the_same_bits_as_a_fast_one() {
    let world = World::new();
    let fast = fly_in_lockstep(&world, "fast", Duration::ZERO);
    let slow = fly_in_lockstep(&world, "slow", Duration::from_millis(20));
    let read = |bag: &Path| {
        let recording = Recording::read(bag);
        let mut states = recording.messages::<SystemState>(STATE);
        states.sort_by_key(|state| state.step);
        let states: Vec<_> = states.into_iter().map(|state| state.bodies).collect();
        (states, recording.messages::<ControlSequence>(FLOWN))
    };
    let (states, flown) = read(&fast);
    assert_eq!(flown.len() as u64, STEPS / 10);
    assert_eq!(states.len() as u64, STEPS + 1);
    for (number, sequence) in flown.iter().enumerate() {
        assert_eq!(sequence.first_step, 10 * number as u64);
        assert!((sequence.step_size - 0.1).abs() < 1e-12);
        assert_eq!(sequence.header.frame_id, "body");
    }
    // The force of the thruster has a lever of 0.5 m.
    assert_eq!(flown[30].moment[0], vector([0.0, 0.0, -0.05]));
    assert!((states, flown) == read(&slow), "the flights differ");
    for bag in [&fast, &slow] {
        world.verify_agrees(bag, STEPS + 1);
    }
    let spin = last(&fast).bodies[0].angular_momentum;
    assert!(
        spin[2].abs() > 0.1,
        "the thruster has not turned it: {spin:?}"
    );
}

#[test]
fn a_wrench_acts_for_its_time_and_one_that_is_wrong_does_not() {
    let world = World::new();
    let parameters = ["wrench_timeout:=0.2", "wrench_max_force:=2.0"];
    let flight = Flight::prepare(&world, "bag", &parameters);
    let wrench = flight
        .operator
        .ros()
        .publisher::<WrenchStamped>("/lgvi_propagator/wrench/body", &Qos::reliable(10))
        .unwrap();
    eventually("the propagator's subscription", || {
        (wrench.matched_subscriptions() > 0).then_some(())
    });
    flight.operator.lead(&["activate"]);
    let mut message = WrenchStamped::default();
    message.header.frame_id = "inertial".into();
    message.wrench.force = vector([0.0, 10.0, 0.0]);
    wrench.publish(&message).unwrap();
    flight.propagator.await_stderr("no new wrench on body");
    message.header.frame_id = "moon".into();
    wrench.publish(&message).unwrap();
    flight.propagator.await_stderr(
        "wrench on body refused: `header.frame_id` is \"moon\", expected one of body, thruster, inertial",
    );
    sleep(Duration::from_millis(1100));
    message.header.frame_id.clear();
    message.wrench.force.y = f64::NAN;
    wrench.publish(&message).unwrap();
    flight
        .propagator
        .await_stderr("`wrench.force` is [0.0, NaN, 0.0], expected three finite numbers");
    let report = flight.propagator.await_flown();
    let (bag, stderr) = flight.end();
    assert_eq!(stderr.matches("no new wrench").count(), 1, "{stderr}");
    let [timeouts] = report.command_timeouts.try_into().unwrap();
    assert_eq!((timeouts.timeouts, timeouts.missed), (1, 0));
    // All that is left of 5 s when it has begun and acted for 0.2 s; what was said since took more than 1 s.
    let idle = timeouts.idle;
    assert!(idle > 1.0 && idle < 4.8 + 1e-9, "{idle}");
    world.verify_agrees(&bag, STEPS + 1);
    // 2 N of the 10 N that were asked for, for 0.2 s.
    let [x, y, z] = last(&bag).bodies[0].linear_momentum;
    assert!((y - 0.4).abs() < 1e-12 && x == 0.0 && z == 0.0, "{y}");
    assert_eq!(
        Recording::read(&bag)
            .messages::<ControlSequence>(FLOWN)
            .len(),
        1
    );
}

/// A body that tumbles beside one that turns about z, with a sensor in each.
fn two_bodies(world: &World) -> PathBuf {
    let other = "[[bodies]]\nname = \"other\"\nmass = 2.0\ninertia = [1.0, 1.0, 1.0]\nposition = [9.0, 0.0, 0.0]\n\
        velocity = [0.0, 0.0, 0.0]\nattitude = { w = 1, x = 0, y = 0, z = 0 }\nangular_velocity = [0.0, 0.0, 1.0]\n\n\
        [[frames]]\nname = \"antenna\"\nparent = \"other\"\nposition = [3.0, 0.0, 0.0]\n\
        attitude = { w = 0, x = 0, y = 0, z = 1 }\n\n[[bodies]]\nname = \"body\"";
    let changes = [
        ("duration = 100.0", "duration = 5.0"),
        ("steps = 10000", "steps = 500"),
        ("[[bodies]]\nname = \"body\"", other),
    ];
    edited(world, "free_body", &changes)
}

/// For 2.5 s in the inertial frame, then in that of an antenna of the other body, whose axes are at half a turn there.
#[test]
fn a_wrench_may_be_held_in_the_inertial_frame_or_in_that_of_another_body() {
    let world = World::new();
    let scene = two_bodies(&world);
    let arguments = ["--await-wrench", "body", "--control-period", "2.5"];
    let mut flight = world.start_flight(&scene, "bag", &arguments);
    let ros = world.ros_node("controller");
    let wrench = ros
        .publisher::<WrenchStamped>("/lgvi_propagator/wrench/body", &Qos::reliable(10))
        .unwrap();
    let odometry = ros
        .subscription::<Odometry>("/lgvi_propagator/odometry/body", &Qos::volatile(1000))
        .unwrap();
    while flight.runs() {
        let Some(message) = odometry.recv_timeout(Duration::from_millis(100)).unwrap() else {
            continue;
        };
        let mut command = WrenchStamped {
            header: message.message.header,
            wrench: Wrench {
                force: vector([1.0, 0.0, 0.0]),
                torque: vector([0.5, 0.0, 0.0]),
            },
        };
        if command.header.stamp.sec > EPOCH {
            command.header.frame_id = "antenna".into();
        }
        wrench.publish(&command).unwrap();
    }
    flight.finish().expect(0);
    let bag = world.path("bag");
    let recording = Recording::read(&bag);
    let flown = recording.messages::<ControlSequence>(FLOWN);
    let frames: Vec<_> = flown.iter().map(|one| &*one.header.frame_id).collect();
    assert_eq!(frames, ["inertial", "other"]);
    assert_eq!(flown[1].force, [vector([-1.0, 0.0, 0.0])]);
    assert!(flown[1].moment_in_frame);
    assert_eq!(flown[1].moment[0].x, -0.5);
    // Force and moment then turn from 2.5 rad to 5 rad, and point in the opposite direction.
    let (start, end) = (2.5_f64.sin_cos(), 5_f64.sin_cos());
    let impulse = [2.5 - (end.0 - start.0), end.1 - start.1, 0.0];
    let mut states = recording.messages::<SystemState>(STATE);
    states.sort_by_key(|state| state.step);
    let momenta = |state: &SystemState| {
        let body = state.bodies.iter().find(|body| body.name == "body");
        let body = body.unwrap();
        let [l, r] = [body.angular_momentum, body.linear_momentum];
        let row = |row: usize| {
            (0..3)
                .map(|k| body.attitude[3 * row + k] * l[k])
                .sum::<f64>()
        };
        [r, [row(0), row(1), row(2)]]
    };
    let [first, last] = [&states[0], &states[500]].map(momenta);
    for (part, scale) in [(0, 1.0), (1, 0.5)] {
        for axis in 0..3 {
            let change = last[part][axis] - first[part][axis];
            let expected = scale * impulse[axis];
            // The axes are those at the beginning of each step, of 0.01 s.
            assert!(
                (change - expected).abs() < 0.02,
                "{part}, {axis}: {change} is not {expected}"
            );
        }
    }
    world.verify_agrees(&bag, STEPS + 1);
}

/// It answers the first state alone; the flight asks at 0 s and 2.5 s.
#[test]
fn a_controller_that_falls_silent_is_counted_in_the_summary() {
    let world = World::new();
    let parameters = [
        "real_time_factor:=0.0",
        "await_wrench:=[body]",
        "control_period:=2.5",
        "control_deadline:=0.3",
        "wrench_timeout:=0.1",
    ];
    let flight = Flight::prepare(&world, "bag", &parameters);
    let wrench = flight
        .operator
        .ros()
        .publisher::<WrenchStamped>("/lgvi_propagator/wrench/body", &Qos::reliable(10))
        .unwrap();
    eventually("the propagator's subscription", || {
        (wrench.matched_subscriptions() > 0).then_some(())
    });
    flight.operator.lead(&["activate"]);
    let mut message = WrenchStamped::default();
    message.header.stamp.sec = EPOCH;
    wrench.publish(&message).unwrap();
    let report = flight.propagator.await_flown();
    let told: Vec<_> = report
        .command_timeouts
        .iter()
        .map(ToString::to_string)
        .collect();
    let expected = "wrench on body: 1 over before another came, nothing acted for 2.500 s; 1 missing at the deadline";
    assert_eq!(told, [expected]);
    let (_, stderr) = flight.end();
    assert!(
        stderr.contains("no wrench on body with the stamp of step 250 came within"),
        "{stderr}"
    );
}

/// In 2000 steps as fast as possible: which comes first does not matter, but that they are recorded in that order.
#[test]
fn wrenches_among_control_sequences_are_repeated_in_their_order() {
    let world = World::new();
    let flight = Flight::prepare(
        &world,
        "bag",
        &["real_time_factor:=2.0", "wrench_timeout:=0.1"],
    );
    let ros = flight.operator.ros();
    let wrench = ros
        .publisher::<WrenchStamped>("/lgvi_propagator/wrench/body", &Qos::reliable(1000))
        .unwrap();
    let sequences = ros
        .publisher::<ControlSequence>("/lgvi_propagator/control_sequence", &Qos::reliable(1000))
        .unwrap();
    eventually("the propagator's subscriptions", || {
        let both = [
            wrench.matched_subscriptions(),
            sequences.matched_subscriptions(),
        ];
        both.into_iter().all(|count| count > 0).then_some(())
    });
    flight.operator.lead(&["activate"]);
    let mut message = WrenchStamped::default();
    for number in 0..60 {
        message.wrench.force.x = f64::from(number);
        message.wrench.torque.z = -0.01 * f64::from(number);
        wrench.publish(&message).unwrap();
        let sequence = ControlSequence {
            body: "body".into(),
            first_step: 8 * number as u64 + 20,
            step_size: 0.02,
            force: vec![vector([0.0, f64::from(number), 0.0]); 5],
            moment: vec![Vector3::default(); 5],
            ..Default::default()
        };
        sequences.publish(&sequence).unwrap();
        sleep(Duration::from_millis(30));
    }
    flight.propagator.await_flown();
    let (bag, _) = flight.end();
    let flown = Recording::read(&bag).messages::<ControlSequence>(FLOWN);
    let of_wrenches = flown.iter().filter(|one| one.force.len() == 1).count();
    assert!(
        of_wrenches > 20 && flown.len() - of_wrenches > 20,
        "{of_wrenches} of {}",
        flown.len()
    );
    world.verify_agrees(&bag, STEPS + 1);
}

/// The controller comes after the first state has been published; the maneuver has no other controls.
#[test]
fn a_controller_that_comes_late_is_asked_again() {
    let world = World::new();
    let scene = lgvi_tests::scene("inclination_change");
    let arguments = [
        "--no-planner",
        "--await-wrench",
        "spacecraft",
        "--control-period",
        "0.0902976",
    ];
    let flight = world.start_flight(&scene, "bag", &arguments);
    flight.await_stderr("waiting at step 0 for the first wrench on spacecraft");
    let ros = world.ros_node("controller");
    let wrench = ros
        .publisher::<WrenchStamped>("/lgvi_propagator/wrench/spacecraft", &Qos::reliable(10))
        .unwrap();
    let odometry = ros
        .subscription::<Odometry>("/lgvi_propagator/odometry/spacecraft", &Qos::volatile(1000))
        .unwrap();
    let mut flight = flight;
    while flight.runs() {
        let Some(message) = odometry.recv_timeout(Duration::from_millis(100)).unwrap() else {
            continue;
        };
        let Odometry {
            header,
            child_frame_id,
            ..
        } = message.message;
        let mut command = WrenchStamped {
            header,
            ..Default::default()
        };
        command.header.frame_id = child_frame_id;
        command.wrench.torque.x = 1e-3;
        wrench.publish(&command).unwrap();
    }
    flight.finish().expect(0);
    let bag = world.path("bag");
    let flown = Recording::read(&bag).messages::<ControlSequence>(FLOWN);
    assert_eq!(flown.len(), 10);
    world.verify_agrees(&bag, 1001);
}

#[test]
fn parameters_of_a_cycle_that_cannot_be_are_refused() {
    let world = World::new();
    let scene = format!("scene:={}", free_body(&world).display());
    for (parameter, says) in [
        (
            "await_wrench:=[moon]",
            "contains \"moon\", expected bodies that take such commands: body",
        ),
        (
            "control_period:=0.015",
            "expected a whole number of the scene's steps of 0.01 s",
        ),
    ] {
        let waits = "await_wrench:=[body]";
        let finished = world
            .node("propagator", &[&scene, waits, parameter])
            .finish();
        finished.expect(2).says(&[says]);
    }
}
