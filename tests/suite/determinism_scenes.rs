//! Every scene of the repository, flown whole as fast as possible: twice the same bits, in flight and repeated; and the same in
//! debug and release builds.
//!
//! What is compared is all of each topic: payloads, log times and their order. How topics lie among each other in the bag's
//! file depends on the order in which they came over shared memory and DDS, and so does the wall-clock time at which DDS says
//! that they were published.

use std::collections::BTreeSet;
use std::hint;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use lgvi_tests::{Recording, Summary, World, binary, eventually, fly_in_release, scene, shipped};

const STATE: &str = "/lgvi_propagator/state";

/// Where the first message of a topic is that another flight has otherwise, if there is one.
fn difference(first: &Recording, second: &Recording) -> Option<String> {
    let (first, second) = (first.contents(), second.contents());
    let topics: BTreeSet<_> = first.keys().chain(second.keys()).collect();
    topics.into_iter().find_map(|topic| {
        let [first, second] = [&first, &second].map(|flight| flight.get(topic));
        let [first, second] = [first, second].map(|messages| messages.map_or(&[][..], |m| m));
        if first.len() != second.len() {
            return Some(format!(
                "{topic}: {} and {} messages",
                first.len(),
                second.len()
            ));
        }
        let differ = first
            .iter()
            .zip(second)
            .position(|(one, other)| one != other)?;
        let [one, other] = [first, second].map(|messages| messages[differ].0);
        Some(format!(
            "{topic}: message {differ}, logged at {one} and {other}"
        ))
    })
}

#[track_caller]
fn equal(first: &Recording, second: &Recording, which: &str) {
    let difference = difference(first, second);
    assert!(
        difference.is_none(),
        "{which} differ: {}",
        difference.unwrap_or_default()
    );
}

fn the_same_bits(name: &str) {
    let world = World::new();
    let fly = |bag: &str| world.fly_fast(&scene(name), bag).1;
    let bag = fly("a");
    let first = Recording::read(&bag);
    assert!(first.contents().contains_key(STATE));
    equal(&first, &Recording::read(&fly("b")), "two flights");
    world.verify_agrees(&bag, first.on(STATE).count() as u64);
}

macro_rules! scenes {
    ($($name:ident),* $(,)?) => {
        $(
            #[test]
            fn $name() {
                the_same_bits(stringify!($name));
            }
        )*

        #[test]
        fn none_is_left_out() {
            assert_eq!(shipped(), [$(stringify!($name)),*]);
        }
    };
}

scenes!(
    asteroid_orbiter,
    binary_asteroid,
    dispersed_capture,
    docking,
    docking_corridor,
    earth_mars,
    formation_change,
    free_body,
    goddard,
    inclination_change,
    inclination_replan,
    inspection,
    low_orbit_approach,
    minimum_fuel,
    minimum_time_slew,
    oblate_orbit,
    orbital_capture,
    pendulum,
    phased_docking,
    propellant_transfer,
    relative_orbit,
    rocks,
    slew_keep_out,
    thruster_approach,
    thruster_rendezvous,
    tumbling_replan,
    tumbling_target,
    two_dumbbells,
    uncertain_flyaround,
    wheel_slew,
    wheel_slew_plan,
);

/// Plans and flights without nodes, hashed by the example `fly`.
#[test]
fn debug_and_release_builds_agree() {
    let scenes: Vec<_> = shipped().iter().map(|name| scene(name)).collect();
    let printed = |program: &Path| {
        let output = Command::new(program).args(&scenes).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let debug = printed(&binary("examples/fly"));
    assert_eq!(debug.lines().count(), scenes.len());
    assert_eq!(debug, printed(&fly_in_release()));
}

/// Flies a scene whose text is changed, with so many plans on the way, and verifies the flight.
#[track_caller]
fn planned_anew(name: &str, changed: impl FnOnce(&str) -> String, plans: u64) -> Summary {
    let world = World::new();
    let text = std::fs::read_to_string(scene(name)).unwrap();
    let path = world.path("replanned.toml");
    std::fs::write(&path, changed(&text)).unwrap();
    let (summary, bag) = world.fly_fast(&path, "replanned");
    let made = summary.replanned.as_ref().unwrap();
    assert_eq!((made.published, made.kept), (plans, 0));
    let recording = Recording::read(&bag);
    world.verify_agrees(&bag, recording.on(STATE).count() as u64);
    summary
}

/// Plans for thrusters that are made on the way take over from each other, and lead to the target.
#[test]
fn a_flight_by_thrusters_is_planned_anew_and_arrives() {
    let keys = "commands = \"thrusters\"\nreplan = { every = 60, deadline = 1.0 }\n";
    let changed = |text: &str| text.replace("commands = \"thrusters\"\n", keys);
    // At steps 60 and 120; at 180 less than 60 steps would be left to a plan.
    let summary = planned_anew("thruster_rendezvous", changed, 2);
    let flown = summary.flight.unwrap();
    let (miss, cost) = (flown.miss.unwrap(), flown.cost.unwrap());
    assert!(miss.position < 1e-5 && miss.attitude < 1e-6, "{miss:?}");
    let planned = summary.plan.unwrap().cost;
    assert!(
        (cost / planned - 1.0).abs() < 1e-5,
        "{cost}, planned {planned}"
    );
}

/// The wheels fly the plan of their torques, which leads to the target at its cost.
#[test]
fn a_flight_by_wheels_arrives_at_the_cost_of_its_plan() {
    let world = World::new();
    let (summary, _) = world.fly_fast(&scene("wheel_slew_plan"), "wheels");
    arrived_by_wheels(&summary, 1e-9);
}

/// Plans for wheels that are made on the way take over from each other, and lead to the target at the cost of the first.
#[test]
fn a_flight_by_wheels_is_planned_anew_and_arrives() {
    let keys = "commands = \"wheels\"\nreplan = { every = 50, deadline = 21.0 }\n";
    let changed = |text: &str| text.replace("commands = \"wheels\"\n", keys);
    // At steps 50 to 300, each from 210 steps later on: up to five of them wait for their first step.
    let summary = planned_anew("wheel_slew_plan", changed, 6);
    arrived_by_wheels(&summary, 1e-7);
}

/// Bodies that are planned together begin elsewhere than expected, and are planned anew on the way.
#[test]
fn a_formation_is_planned_anew_and_arrives() {
    let changed = |text: &str| {
        let text = text.replace("steps = 150", "steps = 60").replace(
            "separation = 40.0",
            "separation = 40.0\nreplan = { every = 15, deadline = 24.0 }",
        );
        let deviations = "position = 0.3\nvelocity = 0.003\n";
        format!(
            "{text}\n[disturbance]\nseed = 1\n{deviations}\n[[disturbance.bodies]]\nbody = \"third\"\n{deviations}"
        )
    };
    // At steps 15 and 30, from 17 and 32 on; at 45 fewer than 15 steps would be left to a plan.
    let flown = planned_anew("formation_change", changed, 2).flight.unwrap();
    let miss = flown.miss.unwrap();
    assert!(miss.position < 1e-4, "{miss:?}");
    assert_eq!(flown.companions.len(), 2);
    for arrival in &flown.companions {
        let miss = arrival.miss.as_ref().unwrap();
        assert!(miss.position < 1e-4, "{miss:?}");
    }
}

#[track_caller]
fn arrived_by_wheels(summary: &Summary, cost_tolerance: f64) {
    let flown = summary.flight.as_ref().unwrap();
    let (miss, cost) = (flown.miss.as_ref().unwrap(), flown.cost.unwrap());
    assert!(miss.attitude < 1e-10, "{miss:?}");
    assert!(miss.angular_momentum < 1e-10, "{miss:?}");
    let planned = summary.plan.as_ref().unwrap().cost;
    assert!(
        (cost / planned - 1.0).abs() < cost_tolerance,
        "{cost}, planned {planned}"
    );
}

/// In lockstep the flight waits for its plans: how long they take, and how slow the machine is, does not matter.
#[test]
fn a_flight_planned_anew_does_not_depend_on_the_planners_speed() {
    let world = World::new();
    let path = scene("inclination_replan");
    let (summary, bag) = world.fly_fast(&path, "undisturbed");
    let plans = summary.replanned.as_ref().unwrap();
    // Steps 50 to 400: at 450 less than 50 steps would be left to a plan.
    assert_eq!((plans.published, plans.kept), (8, 0));
    let undisturbed = Recording::read(&bag);

    let flight = world.start_flight(
        &path,
        "disturbed",
        &["--no-plot", "--real-time-factor", "0"],
    );
    let planner = eventually("the planner", || world.find_process("node planner"));
    let nice = ["-n", "10", "-p", &planner.to_string()];
    let slowed = Command::new("renice").args(nice).output().unwrap();
    assert!(slowed.status.success(), "{slowed:?}");
    let busy = thread::available_parallelism().map_or(2, usize::from);
    let done = AtomicBool::new(false);
    let finished = thread::scope(|scope| {
        for _ in 0..busy {
            scope.spawn(|| {
                while !done.load(Ordering::Relaxed) {
                    hint::spin_loop();
                }
            });
        }
        let finished = catch_unwind(AssertUnwindSafe(|| flight.finish()));
        done.store(true, Ordering::Relaxed);
        finished
    });
    finished.unwrap().expect(0);
    let disturbed = Recording::read(&world.path("disturbed"));
    equal(
        &undisturbed,
        &disturbed,
        "a flight and one with a slow planner",
    );
}
