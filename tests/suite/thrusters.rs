//! Thrusters commanded from outside: in lockstep, in pulses, until the propellant is used up, and their record repeated.

use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use lgvi_msgs::geometry_msgs::InertiaStamped;
use lgvi_msgs::msg::{ControlSequence, SystemState};
use lgvi_msgs::sensor_msgs::{Imu, JointState};
use lgvi_tests::{EffortController, Recording, World, edited};

const STATE: &str = "/lgvi_propagator/state";
const FLOWN: &str = "/lgvi_propagator/flown_control";
const THRUSTERS: &str = "/lgvi_propagator/thruster_states/body";
const INERTIA: &str = "/lgvi_propagator/inertia/body";
const GYRO: &str = "/lgvi_propagator/imu/body/gyro";

/// Steps of the flights, of 0.01 s.
const STEPS: u64 = 500;

/// Exhaust velocity (m/s) and propellant (kg).
const EXHAUST: f64 = 2.0;
const PROPELLANT: f64 = 0.2;

/// `scenes/free_body.toml` with fewer steps, without rotation and with a wheel, two thrusters, and an accelerometer at the
/// center of mass.
fn scene(world: &World) -> PathBuf {
    let actuators = format!(
        "angular_velocity = [0.0, 0.0, 0.0]\n\
        propellant = {{ mass = {PROPELLANT} }}\n\
        [[bodies.wheels]]\nname = \"wheel\"\naxis = [0, 0, 1]\ninertia = 0.01\n\
        [[bodies.thrusters]]\nname = \"main\"\nposition = [0, 0, -0.5]\ndirection = [0, 0, 1]\nthrust = 0.5\n\
        exhaust_velocity = {EXHAUST}\npulse_period = 0.1\nminimum_impulse = 0.01\n\
        [[bodies.thrusters]]\nname = \"side\"\nposition = [0.5, 0, 0]\ndirection = [0, 1, 0]\nthrust = 0.1\ndelay = 0.03\n\
        [[bodies.sensors]]\nname = \"gyro\"\nkind = \"imu\"\nperiod = 0.1\n"
    );
    let changes = [
        ("duration = 100.0", "duration = 5.0"),
        ("steps = 10000", "steps = 500"),
        ("ros_every = 100", "ros_every = 10"),
        ("angular_velocity = [1.0, 0.5, -0.75]", actuators.as_str()),
    ];
    edited(world, "free_body", &changes)
}

/// Flies with a controller that fires the main thruster more and more, and takes its time to answer.
fn fly_in_lockstep(world: &World, bag: &str, thinks: Duration) -> PathBuf {
    let arguments = ["--await-thrust", "body", "--control-period", "0.1"];
    let flight = EffortController::start(world, "thrust", &scene(world), bag, &arguments);
    flight.control(STEPS / 10, 0.1, |number| {
        sleep(thinks);
        [("main", 0.01 * number as f64)]
    });
    flight.flight.finish().expect(0);
    world.path(bag)
}

#[test]
fn in_lockstep_pulses_push_and_use_propellant() {
    let world = World::new();
    let fast = fly_in_lockstep(&world, "fast", Duration::ZERO);
    let slow = fly_in_lockstep(&world, "slow", Duration::from_millis(20));
    let read = |bag: &Path| {
        let recording = Recording::read(bag);
        let mut states = recording.messages::<SystemState>(STATE);
        states.sort_by_key(|state| state.step);
        let states: Vec<_> = states.into_iter().map(|state| state.bodies).collect();
        let thrusters = recording.messages::<JointState>(THRUSTERS);
        (states, thrusters)
    };
    let (states, thrusters) = read(&fast);
    assert!(
        (states.clone(), thrusters.clone()) == read(&slow),
        "the flights differ"
    );
    for bag in [&fast, &slow] {
        world.verify_agrees(bag, STEPS + 1);
    }
    let recording = Recording::read(&fast);
    let flown = recording.messages::<ControlSequence>(FLOWN);
    assert_eq!(flown.len() as u64, STEPS / 10);
    assert_eq!(flown[20].thrust, [0.2, 0.0]);
    assert!(flown[20].wheel_torque.is_empty() && flown[20].force.is_empty());

    // What is asked for in 0.1 s is a pulse, unless it is less than the minimum impulse.
    let asked = (0..STEPS / 10).map(|number| 1e-3 * number as f64);
    let pulses: f64 = asked.filter(|impulse| *impulse > 0.00999).sum();
    let last = thrusters.last().unwrap();
    assert_eq!(last.name, ["main", "side"]);
    let impulse = pulses.min(PROPELLANT * EXHAUST);
    assert!((last.position[0] - impulse).abs() < 1e-9, "{last:?}");
    let inertias = recording.messages::<InertiaStamped>(INERTIA);
    let masses: Vec<_> = inertias.iter().map(|one| one.inertia.m).collect();
    let used = masses[0] - masses[masses.len() - 1];
    assert!((used - impulse / EXHAUST).abs() < 1e-9, "{masses:?}");
    // The rocket equation, although the body is pushed in pulses.
    let speed = EXHAUST * f64::ln(masses[0] / (masses[0] - used));
    let velocity = states[states.len() - 1][0].linear_momentum[2] / (masses[0] - used);
    assert!((velocity - speed).abs() < 1e-6, "{velocity} {speed}");
    // The accelerometer has felt it.
    let felt = recording.messages::<Imu>(GYRO);
    let felt: f64 = felt[1..]
        .iter()
        .map(|one| 0.1 * one.linear_acceleration.z)
        .sum();
    assert!((felt - velocity).abs() < 1e-12, "{felt} {velocity}");
    world
        .lgvi(["plot", fast.to_str().unwrap()])
        .finish()
        .expect(0);
}

#[test]
fn thrust_ends_after_its_time_and_wrong_ones_are_refused() {
    let world = World::new();
    let flight = EffortController::start(
        &world,
        "thrust",
        &scene(&world),
        "bag",
        &["--real-time-factor", "1"],
    );
    let state = flight.state();
    flight.answer(&state, &[("side", 0.1)]);
    flight.answer(&state, &[("third", 0.1)]);
    flight.flight.await_stderr(
        "command for the thrusters of body refused: `name` contains \"third\", expected thrusters of the body: main, side",
    );
    flight
        .flight
        .await_stderr("no new command for the thrusters of body");
    flight.flight.finish().expect(0);
    let bag = world.path("bag");
    world.verify_agrees(&bag, STEPS + 1);
    // 0.1 N for the second that a command acts for: it begins and ends later by the delay.
    let states = Recording::read(&bag).messages::<JointState>(THRUSTERS);
    let last = states.last().unwrap();
    assert!((last.position[1] - 0.1).abs() < 1e-9, "{last:?}");
    assert_eq!(last.position[0], 0.0);
}
