//! Reference bags, played into nodes that know nothing of how they were made: the propagator flies the recorded controls to the
//! recorded states, the planner answers the recorded states with the recorded plans, all to the last bit.

use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use lgvi_middleware::ros::{Qos, Subscription};
use lgvi_msgs::msg::{ControlSequence, PlanProgress, Scene};
use lgvi_tests::{PATIENCE, Process, Recording, World, binary, eventually, reference_bag};

const STATE: &str = "/lgvi_propagator/state";
const FLOWN: &str = "/lgvi_propagator/flown_control";
const ODOMETRY: &str = "/lgvi_propagator/odometry/spacecraft";
const INVARIANTS: &str = "/lgvi_propagator/invariants";
const PLANNED: &str = "/lgvi_planner/control_sequence";
const PROGRESS: &str = "/lgvi_planner/progress";

/// Long enough for a message that must not come.
const QUIET: Duration = Duration::from_millis(300);

/// A bag, and its scene as a file.
fn open(world: &World, name: &str) -> (Recording, PathBuf) {
    let bag = Recording::read(&reference_bag(name));
    let scene = bag
        .messages::<Scene>("/lgvi_propagator/scene")
        .pop()
        .unwrap();
    let path = world.path(&scene.name).with_extension("toml");
    fs::write(&path, scene.text).unwrap();
    (bag, path)
}

/// Starts a node with arguments of ROS.
fn node(world: &World, kind: &str, arguments: &[&str]) -> Process {
    let mut command = world.command(&binary(&format!("lgvi_{kind}")));
    command.args(["--supervised", "--ros-args"]).args(arguments);
    world.start(kind, command)
}

/// Plays some topics of a recording at a rate, once each has a subscriber.
fn play(world: &World, recording: &Recording, topics: &[&str], rate: &str) {
    let bag = world.path("played");
    recording.clone().only(topics).write(&bag);
    let bag = format!("bag:={}", bag.display());
    let player = world.node("player", &[&bag, rate, "await_subscribers:=1"]);
    player.finish().expect(0);
}

/// Log times and payloads of a topic.
fn contents<'a>(recording: &'a Recording, topic: &str) -> Vec<(u64, &'a [u8])> {
    let records = recording.on(topic);
    records
        .map(|record| (record.log_time, &*record.data))
        .collect()
}

/// Flies the bag's scene under the bag's controls alone.
fn controls_give_the_states(name: &str, lockstep: bool) {
    let world = World::new();
    let (recorded, scene) = open(&world, name);
    let repeated = world.path("repeated");
    let output = format!("output:={}", repeated.display());
    let topics = format!(
        "topics:=['{FLOWN}=lgvi_msgs/msg/ControlSequence', '{ODOMETRY}=nav_msgs/msg/Odometry', \
         '/tf=tf2_msgs/msg/TFMessage', '/lgvi_propagator/scene=lgvi_msgs/msg/Scene', \
         '{INVARIANTS}=lgvi_msgs/msg/Invariants']"
    );
    let stamps = ["log_time:=stamp", "await_stamp:=true"];
    let recorder = world.node("recorder", &[&output, &topics, stamps[0], stamps[1]]);
    recorder.await_ready();
    let scene = format!("scene:={}", scene.display());
    let lockstep = format!("lockstep:={lockstep}");
    let remapping = format!("~/control_sequence:={PLANNED}");
    let mut arguments = vec!["-r", &remapping, "-p", &scene, "-p", &lockstep];
    arguments.extend(["-p", "real_time_factor:=0.0", "-p", "await_subscribers:=1"]);
    let propagator = node(&world, "propagator", &arguments);
    propagator.await_ready();

    play(&world, &recorded, &[PLANNED], "rate:=0");
    let report = propagator.await_flown();
    propagator.stop().expect(0);
    recorder.stop().expect(0);
    let flown = Recording::read(&repeated);
    assert_eq!(flown.on(STATE).count() as u64, report.steps + 1);
    for topic in [STATE, FLOWN, ODOMETRY, INVARIANTS, "/tf"] {
        assert!(!contents(&flown, topic).is_empty(), "{topic}");
        assert!(
            contents(&flown, topic) == contents(&recorded, topic),
            "{topic}"
        );
    }
}

#[test]
fn the_propagator_flies_recorded_controls_to_the_recorded_states() {
    controls_give_the_states("inclination_change", false);
    controls_give_the_states("orbital_capture", false);
}

#[test]
fn the_propagator_flies_recorded_plans_made_in_flight_to_the_recorded_states() {
    controls_give_the_states("inclination_replan", true);
}

/// The next `count` messages, and no others.
#[track_caller]
fn heard<M: lgvi_msgs::RosMessage + Send + Sync + 'static>(
    subscription: &Subscription<M>,
    count: usize,
) -> Vec<M> {
    let next = |_| subscription.recv_timeout(PATIENCE).unwrap();
    let messages: Vec<_> = (0..count)
        .map_while(next)
        .map(|sample| sample.message)
        .collect();
    assert_eq!(
        messages.len(),
        count,
        "messages on {}",
        subscription.topic()
    );
    let further = subscription.recv_timeout(QUIET).unwrap();
    assert!(further.is_none(), "a further message");
    messages
}

/// Has the bag's scene planned anew, and in flight where the bag's states are played.
fn plans_are_those_recorded(name: &str, in_flight: bool) {
    let world = World::new();
    let (recorded, scene) = open(&world, name);
    let [planned, told] = [PLANNED, PROGRESS].map(|topic| recorded.on(topic).count());
    let observer = world.ros_node("observer");
    let plans = observer
        .subscription::<ControlSequence>(PLANNED, &Qos::latched(100))
        .unwrap();
    let progress = observer
        .subscription::<PlanProgress>(PROGRESS, &Qos::latched(1000))
        .unwrap();
    let scene = format!("scene:={}", scene.display());
    let lockstep = format!("lockstep:={in_flight}");
    let remapping = format!("~/state:={STATE}");
    let planner = node(
        &world,
        "planner",
        &["-r", &remapping, "-p", &scene, "-p", &lockstep],
    );
    planner.await_ready();
    if in_flight {
        // Who does not look for states while a player is there never hears of them: first comes the planner's own plan.
        let told = observer.subscription::<PlanProgress>(PROGRESS, &Qos::latched(1000));
        let told = told.unwrap();
        eventually("the first plan", || {
            let told = told.take().unwrap()?.message;
            (told.status == PlanProgress::CONVERGED).then_some(())
        });
        play(&world, &recorded, &[STATE], "rate:=4.0");
    }
    let plans = heard(&plans, planned);
    assert!(
        plans == recorded.messages::<ControlSequence>(PLANNED),
        "the plans differ"
    );
    let progress = heard(&progress, told);
    assert!(
        progress == recorded.messages::<PlanProgress>(PROGRESS),
        "their making differs"
    );
    planner.stop().expect(0);
}

#[test]
fn the_planner_answers_recorded_scenes_with_the_recorded_plans() {
    plans_are_those_recorded("inclination_change", false);
    plans_are_those_recorded("orbital_capture", false);
}

#[test]
fn the_planner_answers_recorded_states_with_the_plans_recorded_in_flight() {
    plans_are_those_recorded("inclination_replan", true);
}
