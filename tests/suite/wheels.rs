//! Reaction wheels commanded from outside: in lockstep, held, over, and their record repeated.

use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

use lgvi_msgs::msg::{ControlSequence, Invariants, SystemState};
use lgvi_msgs::sensor_msgs::JointState;
use lgvi_tests::{EffortController, Recording, World, edited, efforts};

const STATE: &str = "/lgvi_propagator/state";
const FLOWN: &str = "/lgvi_propagator/flown_control";
const JOINTS: &str = "/lgvi_propagator/joint_states/body";

/// Steps of the flights, of 0.01 s.
const STEPS: u64 = 500;

/// `scenes/free_body.toml` with fewer steps, without rotation and with two wheels, of which the second is slow.
fn scene(world: &World) -> PathBuf {
    let wheels = "angular_velocity = [0.0, 0.0, 0.0]\n\
        [[bodies.wheels]]\nname = \"fast\"\naxis = [0, 0, 2]\ninertia = 0.01\nspeed = 100.0\nmax_torque = 0.5\n\
        [[bodies.wheels]]\nname = \"slow\"\naxis = [1, 0, 1]\ninertia = 0.02\nmax_speed = 20.0\n";
    let changes = [
        ("duration = 100.0", "duration = 5.0"),
        ("steps = 10000", "steps = 500"),
        ("ros_every = 100", "ros_every = 10"),
        ("angular_velocity = [1.0, 0.5, -0.75]", wheels),
    ];
    edited(world, "free_body", &changes)
}

/// Flies with a controller that speeds the wheels up, and takes its time to answer.
fn fly_in_lockstep(world: &World, bag: &str, thinks: Duration) -> PathBuf {
    let arguments = ["--await-wheels", "body", "--control-period", "0.1"];
    let flight = EffortController::start(world, "wheel_torque", &scene(world), bag, &arguments);
    flight.control(STEPS / 10, 0.1, |number| {
        sleep(thinks);
        let first = if number < 10 { 0.2 } else { -2.0 };
        [("slow", 0.3), ("fast", first)]
    });
    flight.flight.finish().expect(0);
    world.path(bag)
}

fn norm(vector: [f64; 3]) -> f64 {
    vector
        .iter()
        .map(|component| component * component)
        .sum::<f64>()
        .sqrt()
}

#[test]
fn in_lockstep_wheels_turn_the_body_and_the_total_momentum_stays() {
    let world = World::new();
    let fast = fly_in_lockstep(&world, "fast", Duration::ZERO);
    let slow = fly_in_lockstep(&world, "slow", Duration::from_millis(20));
    let read = |bag: &Path| {
        let recording = Recording::read(bag);
        let mut states = recording.messages::<SystemState>(STATE);
        states.sort_by_key(|state| state.step);
        let states: Vec<_> = states.into_iter().map(|state| state.bodies).collect();
        let joints = recording.messages::<JointState>(JOINTS);
        (states, joints, recording.messages::<ControlSequence>(FLOWN))
    };
    let (states, joints, flown) = read(&fast);
    assert_eq!(flown.len() as u64, STEPS / 10);
    assert_eq!(flown[20].wheel_torque, [-2.0, 0.3]);
    assert!(flown[20].force.is_empty());
    assert!(
        (states, joints.clone(), flown) == read(&slow),
        "the flights differ"
    );
    for bag in [&fast, &slow] {
        world.verify_agrees(bag, STEPS + 1);
    }

    assert_eq!(joints.len() as u64, STEPS / 10 + 1);
    let [first, last] = [&joints[0], &joints[joints.len() - 1]];
    assert_eq!(first.name, ["fast", "slow"]);
    assert_eq!(first.velocity, [100.0, 0.0]);
    // The motor of the first is weaker than asked for; the second has reached its largest speed.
    assert!(
        (joints[15].effort[0] + 0.5).abs() < 1e-12,
        "{:?}",
        joints[15]
    );
    assert!((last.velocity[1] - 20.0).abs() < 0.5, "{last:?}");
    let spins = Recording::read(&fast).messages::<Invariants>("/lgvi_propagator/invariants");
    let start = spins[0].angular_momentum;
    assert!((norm(start) - 1.0).abs() < 1e-12, "{start:?}");
    for invariants in &spins {
        let change: Vec<_> = (0..3)
            .map(|i| invariants.angular_momentum[i] - start[i])
            .collect();
        let change = norm([change[0], change[1], change[2]]);
        assert!(change < 1e-13, "{change:e} at step {}", invariants.step);
    }
    let states = Recording::read(&fast).messages::<SystemState>(STATE);
    let turned = states
        .iter()
        .map(|state| norm(state.bodies[0].angular_momentum));
    assert!(turned.fold(0.0, f64::max) > 0.3, "the body has not turned");
    world
        .lgvi(["plot", fast.to_str().unwrap()])
        .finish()
        .expect(0);
}

#[test]
fn torques_end_after_their_time_and_wrong_ones_are_refused() {
    let world = World::new();
    let flight = EffortController::start(
        &world,
        "wheel_torque",
        &scene(&world),
        "bag",
        &["--real-time-factor", "1"],
    );
    let state = flight.state();
    let refused = |named: &[(&str, f64)], says: &str| {
        flight.answer(&state, named);
        flight
            .flight
            .await_stderr(&format!("command for the wheels of body refused: {says}"));
        sleep(Duration::from_millis(1050));
    };
    flight.answer(&state, &[("fast", 0.1)]);
    refused(
        &[("third", 0.1)],
        "`name` contains \"third\", expected wheels of the body: fast, slow",
    );
    refused(
        &[("slow", f64::NAN)],
        "`effort` of slow is NaN, expected a finite number",
    );
    let mut message = efforts(&state, &[("slow", 0.1)]);
    message.effort.clear();
    flight.efforts.publish(&message).unwrap();
    flight
        .flight
        .await_stderr("1 elements in `name` and 0 in `effort`, expected the same number");
    flight
        .flight
        .await_stderr("no new command for the wheels of body");
    flight.flight.finish().expect(0);
    let bag = world.path("bag");
    world.verify_agrees(&bag, STEPS + 1);
    let flown = Recording::read(&bag).messages::<ControlSequence>(FLOWN);
    assert_eq!(flown.len(), 1);
    // 0.1 N m for the second that a torque acts for.
    let joints = Recording::read(&bag).messages::<JointState>(JOINTS);
    let last = &joints[joints.len() - 1];
    assert!((last.velocity[0] - 110.0).abs() < 0.1, "{last:?}");
}
