//! Reset, pause, step and set_state: a flight changed from outside, and its record repeated.

use std::cell::Cell;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use lgvi_middleware::ros::{Qos, Subscription};
use lgvi_msgs::geometry_msgs::Vector3;
use lgvi_msgs::msg::{BodyState, ControlSequence, Intervention, SystemState};
use lgvi_msgs::srv::{
    SetState, SetStateRequest, SetStateResponse, Step, StepRequest, StepResponse,
};
use lgvi_msgs::std_srvs::srv::{SetBool, SetBoolRequest, Trigger, TriggerRequest};
use lgvi_tests::{
    Operator, PATIENCE, Process, Recording, Summary, World, coast, edited, eventually, publish,
    scene,
};

const STATE: &str = "/lgvi_propagator/state";
const FLOWN: &str = "/lgvi_propagator/flown_control";
const INTERVENTION: &str = "/lgvi_propagator/intervention";

/// Enough time for a state that was published to arrive.
const QUIET: Duration = Duration::from_millis(300);

/// A flight in real time: its bag, its states over DDS, and who operates it.
struct Flight {
    propagator: Process,
    recorder: Process,
    bag: PathBuf,
    operator: Operator,
    states: Subscription<SystemState>,
    /// The last state's step.
    last: Cell<u64>,
}

impl Flight {
    /// Begins to fly a scene with further parameters, once its states have a subscriber.
    fn begin(world: &World, scene: &std::path::Path, parameters: &[&str]) -> Self {
        let bag = world.path("bag");
        let output = format!("output:={}", bag.display());
        let topics = format!(
            "topics:=['/lgvi_propagator/scene=lgvi_msgs/msg/Scene', \
             '{FLOWN}=lgvi_msgs/msg/ControlSequence', '{INTERVENTION}=lgvi_msgs/msg/Intervention', \
             '/lgvi_propagator/invariants=lgvi_msgs/msg/Invariants']"
        );
        let recorder = world.node("recorder", &[&output, &topics, "log_time:=stamp"]);
        recorder.await_ready();
        let operator = world.operator("lgvi_propagator");
        let states = operator
            .ros()
            .subscription(STATE, &Qos::reliable(5000))
            .unwrap();
        let scene = format!("scene:={}", scene.display());
        let mut all = vec!["autostart:=false", &*scene];
        all.extend(parameters);
        let propagator = world.node("propagator", &all);
        operator.lead(&["configure"]);
        eventually("the states' publisher", || {
            (states.matched_publishers() > 0).then_some(())
        });
        operator.lead(&["activate"]);
        Self {
            propagator,
            recorder,
            bag,
            operator,
            states,
            last: Cell::new(0),
        }
    }

    #[track_caller]
    fn next(&self) -> SystemState {
        let sample = self.states.recv_timeout(PATIENCE).unwrap();
        let state = sample.expect("a state").message;
        self.last.set(state.step);
        state
    }

    /// Takes states until one of at least a step has come.
    #[track_caller]
    fn reach(&self, step: u64) {
        while self.last.get() < step {
            self.next();
        }
    }

    /// The first state of at least a step.
    #[track_caller]
    fn at(&self, step: u64) -> SystemState {
        loop {
            let state = self.next();
            if state.step >= step {
                return state;
            }
        }
    }

    /// Nothing comes any more.
    #[track_caller]
    fn is_still(&self) {
        let sample = self.states.recv_timeout(QUIET).unwrap();
        assert!(sample.is_none(), "{sample:?}");
    }

    /// Pauses it or has it go on; the step at which that is.
    #[track_caller]
    fn pause(&self, data: bool) -> u64 {
        let reply = self
            .operator
            .call::<SetBool>("pause", &SetBoolRequest { data });
        assert!(reply.success, "{}", reply.message);
        let step = reply.message.strip_prefix("step ");
        step.and_then(|step| step.parse().ok())
            .unwrap_or_else(|| panic!("{}", reply.message))
    }

    fn step(&self, steps: u32) -> StepResponse {
        self.operator.call::<Step>("step", &StepRequest { steps })
    }

    fn set(&self, bodies: &[BodyState]) -> SetStateResponse {
        let bodies = bodies.to_vec();
        self.operator
            .call::<SetState>("set_state", &SetStateRequest { bodies })
    }

    #[track_caller]
    fn reset(&self) {
        let reply = self
            .operator
            .call::<Trigger>("reset", &TriggerRequest::default());
        assert!(reply.success, "{}", reply.message);
    }

    /// Ends it; its bag.
    #[track_caller]
    fn end(self) -> PathBuf {
        self.propagator.stop().expect(0);
        self.recorder.stop().expect(0);
        self.bag
    }
}

/// Steps of samples, in the order in which they were published.
fn steps(bag: &std::path::Path) -> Vec<u64> {
    let mut states = Recording::read(bag).messages::<SystemState>(STATE);
    states.sort_by_key(|state| state.sequence);
    states.iter().map(|state| state.step).collect()
}

/// `scenes/free_body.toml` with fewer steps, and its states on DDS as often as over shared memory.
fn free_body(world: &World, steps: u64) -> PathBuf {
    let duration = format!("duration = {:?}", steps as f64 / 100.0);
    let changes = [
        ("duration = 100.0", &*duration),
        ("steps = 10000", &*format!("steps = {steps}")),
    ];
    edited(world, "free_body", &changes)
}

const EVERY: &str = "ros_every:=1";

#[test]
fn a_paused_flight_makes_no_steps_but_those_asked_for() {
    let world = World::new();
    let flight = Flight::begin(&world, &free_body(&world, 3000), &[EVERY]);
    let early = flight.step(1);
    assert!(
        !early.success && early.message.contains("not paused"),
        "{early:?}"
    );

    flight.at(50);
    let stopped = flight.pause(true);
    flight.reach(stopped);
    flight.is_still();
    let made = flight.step(7);
    assert_eq!((made.success, made.step), (true, stopped + 7));
    for step in 1..=7 {
        assert_eq!(flight.next().step, stopped + step);
    }
    flight.is_still();
    let none = flight.step(0);
    assert!(
        !none.success && none.message.contains("at least 1"),
        "{none:?}"
    );

    assert_eq!(flight.pause(false), stopped + 7);
    // What was missed is not made up for: half a second is fifty steps.
    let start = Instant::now();
    assert_eq!(flight.next().step, stopped + 8);
    flight.at(stopped + 58);
    assert!(
        start.elapsed() >= Duration::from_millis(400),
        "{:?}",
        start.elapsed()
    );

    flight.pause(true);
    let beyond = flight.step(5000);
    assert_eq!((beyond.success, beyond.step), (false, 0));
    assert!(beyond.message.contains("3000"), "{beyond:?}");
    flight.reach(3000);
    flight.is_still();
    let bag = flight.end();
    world.verify_agrees(&bag, 3001);
}

#[test]
fn states_are_set_at_a_step_all_or_none() {
    let world = World::new();
    // Samples are rarer than steps: what is set is published all the same, before and after.
    let parameters = ["ros_every:=7", "state_every:=5"];
    let scene = edited(&world, "two_dumbbells", &[]);
    let flight = Flight::begin(&world, &scene, &parameters);
    flight.at(14);
    let stopped = flight.pause(true);
    // A step of which there is no state, neither here nor there.
    let unpublished = |step: &u64| !(step.is_multiple_of(5) || step.is_multiple_of(7));
    let now = (stopped + 1..).find(unpublished).unwrap();
    let made = flight.step((now - stopped) as u32);
    assert!(made.success && made.step == now, "{made:?}");
    flight.reach(now / 7 * 7);

    let names: Vec<_> = bodies(&scene);
    let state = |name: &str| BodyState {
        name: name.into(),
        position: [3.0, 0.25, -1.0],
        linear_momentum: [0.1, 0.2, 0.3],
        attitude: [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        angular_momentum: [0.01, 0.02, 0.03],
    };
    let good = state(&names[0]);
    let refused = |bodies: &[BodyState], why: &str| {
        let reply = flight.set(bodies);
        assert!(!reply.success && reply.message.contains(why), "{reply:?}");
    };
    refused(&[], "empty");
    refused(&[good.clone(), state("moon")], "\"moon\"");
    refused(&[good.clone(), good.clone()], "twice");
    let mut infinite = state(&names[1]);
    infinite.position[2] = f64::INFINITY;
    refused(&[good.clone(), infinite], "not finite");
    let mut skewed = state(&names[1]);
    skewed.attitude[0] = 0.5;
    refused(&[good.clone(), skewed], "expected a rotation");
    let mut mirrored = state(&names[1]);
    mirrored.attitude[8] = -1.0;
    refused(&[good.clone(), mirrored], "determinant -1");
    flight.is_still();
    let mut fast = state(&names[1]);
    fast.linear_momentum[0] = 1e200;
    refused(&[good.clone(), fast], "no step can be made");
    let mut spinning = state(&names[1]);
    spinning.angular_momentum[0] = 1e3;
    refused(&[good.clone(), spinning], "no step can be made");

    let reply = flight.set(std::slice::from_ref(&good));
    assert_eq!((reply.success, reply.step), (true, now), "{reply:?}");
    let (before, after) = (flight.next(), flight.next());
    assert_eq!((before.step, after.step), (now, now));
    for (was, is) in before.bodies.iter().zip(&after.bodies) {
        if is.name == names[0] {
            let near = |found: &[f64], given: &[f64]| {
                found.iter().zip(given).all(|(a, b)| (a - b).abs() < 1e-12)
            };
            assert!(near(&is.position, &good.position), "{is:?}");
            assert!(near(&is.angular_momentum, &good.angular_momentum), "{is:?}");
        } else {
            assert_eq!(was, is, "another body was moved");
        }
    }
    flight.pause(false);
    flight.at(now + 20);
    let bag = flight.end();
    let steps = steps(&bag);
    assert_eq!(
        steps.iter().filter(|step| **step == now).count(),
        2,
        "{steps:?}"
    );
    let verdict = world.verify(&bag, 0);
    assert!(verdict.difference.is_none(), "{verdict:?}");
    assert_eq!(
        (verdict.interventions, verdict.states),
        (1, steps.len() as u64)
    );

    // What was set is part of what was flown.
    let mut altered = Recording::read(&bag);
    altered.edit(INTERVENTION, 0, |intervention: &mut Intervention| {
        intervention.bodies[0].linear_momentum[1] += 1e-12;
    });
    altered.write(&world.path("altered"));
    let difference = world.verify(&world.path("altered"), 1).difference.unwrap();
    assert_eq!(difference.step, now);
    assert_eq!(difference.field, "linear_momentum[1]");
}

/// The names of a scene's bodies.
fn bodies(scene: &std::path::Path) -> Vec<String> {
    let text = std::fs::read_to_string(scene).unwrap();
    let names = text.lines().filter_map(|line| line.strip_prefix("name = "));
    names
        .map(|name| name.trim_matches('"').to_owned())
        .collect()
}

/// A push from a step on.
fn push(first_step: u64, force: f64) -> ControlSequence {
    let push = Vector3 {
        x: force,
        y: 0.0,
        z: 0.0,
    };
    let coast = coast();
    let steps = 1000 - first_step as usize;
    ControlSequence {
        first_step,
        force: vec![push; steps],
        moment: coast.moment[..steps].to_vec(),
        ..coast
    }
}

#[test]
fn a_reset_flight_begins_with_what_it_began_with_and_verifies() {
    let world = World::new();
    let parameters = [EVERY, "real_time_factor:=0.1"];
    let flight = Flight::begin(&world, &scene("inclination_change"), &parameters);
    let _first = publish(flight.operator.ros(), &push(0, 0.1));
    flight.at(60);
    let stranger = world.ros_node("stranger");
    let _second = publish(&stranger, &push(200, 0.5));
    let reached = flight.at(260);
    flight.reset();
    // Those that were published before the reset are behind the first one of step 0.
    let first = loop {
        let state = flight.next();
        if state.step == 0 {
            break state;
        }
    };
    assert!(first.sequence > reached.sequence, "{first:?}");
    let again = flight.at(260);
    let pushed = |state: &SystemState| state.bodies[0].linear_momentum;
    assert_eq!(again.step, reached.step);
    assert_ne!(
        pushed(&again),
        pushed(&reached),
        "the later sequence is still flown"
    );
    flight.pause(true);
    let bag = flight.end();

    let recording = Recording::read(&bag);
    let mut flown = recording.on(FLOWN).collect::<Vec<_>>();
    flown.sort_by_key(|record| record.sequence);
    let first_steps: Vec<_> = flown
        .iter()
        .map(|record| lgvi_msgs::cdr::decode::<ControlSequence>(&record.data).unwrap())
        .map(|sequence| sequence.first_step)
        .collect();
    assert_eq!(first_steps, [0, 200, 0]);
    let interventions = recording.messages::<Intervention>(INTERVENTION);
    let [reset] = &interventions[..] else {
        panic!("{interventions:?}")
    };
    assert_eq!(
        (reset.kind, reset.step, reset.controls),
        (Intervention::RESET, 0, 2)
    );
    let verdict = world.verify(&bag, 0);
    assert!(verdict.difference.is_none(), "{verdict:?}");
    assert_eq!((verdict.sequences, verdict.interventions), (3, 1));
    assert_eq!(verdict.states, recording.on(STATE).count() as u64);

    // A state of the second course is compared with the second course.
    let mut altered = recording.clone();
    let last = recording.messages::<SystemState>(STATE);
    let index = last.iter().rposition(|state| state.step == 100).unwrap();
    altered.edit(STATE, index, |state: &mut SystemState| {
        state.bodies[0].position[0] += 1e-9;
    });
    altered.write(&world.path("altered"));
    assert_eq!(
        world
            .verify(&world.path("altered"), 1)
            .difference
            .unwrap()
            .step,
        100
    );

    let refused = |recording: Recording, name: &str, why: &str| {
        let bag = world.path(name);
        recording.write(&bag);
        let verify = world.lgvi(["verify".as_ref(), bag.as_os_str()]).finish();
        verify.expect(2).says(&[bag.to_str().unwrap(), why]);
    };
    refused(
        recording.clone().without(INTERVENTION),
        "without",
        "or a reset is missing",
    );
    let mut early = recording.clone();
    early.edit(INTERVENTION, 0, |reset: &mut Intervention| {
        reset.controls = 9
    });
    refused(early, "early", "there are 3");
    let mut other = recording;
    other.edit(INTERVENTION, 0, |reset: &mut Intervention| {
        reset.kind = Intervention::SET_STATE;
    });
    refused(other, "other", "next intervention is states set at step 0");
}

#[test]
fn a_flight_is_reset_and_changed_before_its_first_step_and_after_its_last() {
    let world = World::new();
    let parameters = [EVERY, "real_time_factor:=0.0"];
    let flight = Flight::begin(&world, &scene("inclination_change"), &parameters);
    // It waits for a control sequence, and has not published anything.
    flight.reset();
    let first = [flight.next(), flight.next()];
    assert_eq!([first[0].step, first[1].step], [0, 0]);
    flight.is_still();
    let body = BodyState {
        position: [1.1, 0.0, 0.0],
        ..first[1].bodies[0].clone()
    };
    assert!(flight.set(std::slice::from_ref(&body)).success);
    let _controls = publish(flight.operator.ros(), &coast());
    let moved = flight.next();
    assert_eq!((moved.step, moved.bodies[0].position), (0, body.position));
    flight.at(1000);
    assert!(flight.set(std::slice::from_ref(&body)).success);
    flight.reset();
    let last = loop {
        let state = flight.next();
        if state.step == 0 {
            break flight.at(1000);
        }
    };
    assert_ne!(last.bodies[0].position, body.position);
    let bag = flight.end();
    let verdict = world.verify(&bag, 0);
    assert!(verdict.difference.is_none(), "{verdict:?}");
    assert_eq!((verdict.sequences, verdict.interventions), (2, 4));
    // Two of step 0 and a changed one, a thousand, a changed one, and a thousand and one.
    assert_eq!(verdict.states, 2 + 1 + 1000 + 1 + 1001);
}

/// A flight of 3.6 s in real time.
const SHORT: (&str, &str) = ("time = \"10 s\"", "time = \"4 s\"");

#[test]
fn a_flight_that_is_planned_anew_is_so_after_a_reset_too() {
    let world = World::new();
    let scene = edited(&world, "inclination_replan", &[SHORT]);
    let flight = world.start_flight(&scene, "flight", &[]);
    let operator = world.operator("lgvi_propagator");
    let flown: Subscription<ControlSequence> = operator
        .ros()
        .subscription(FLOWN, &Qos::latched(16))
        .unwrap();
    let reset = operator.client::<Trigger>("reset");
    // In the middle of the flight, with plans made on the way.
    let mut planned = Vec::new();
    eventually("three plans made in flight", || {
        let first_step = flown.take().unwrap()?.message.first_step;
        planned.extend((first_step > 0).then_some(first_step));
        (planned.len() == 3).then_some(())
    });
    let reply = reset.call(&TriggerRequest::default(), PATIENCE).unwrap();
    assert!(reply.success, "{}", reply.message);
    let finished = flight.finish().expect(0);
    assert!(
        !finished.stderr.contains("no picture"),
        "{}",
        finished.stderr
    );
    let summary: Summary = finished.json();
    assert_eq!(summary.lost, Some(0));
    assert_eq!(summary.recorded[INTERVENTION], 1);
    assert_eq!(summary.published[INTERVENTION], 1);

    let bag = summary.bag.unwrap();
    let recording = Recording::read(&bag);
    let mut records = recording.on(FLOWN).collect::<Vec<_>>();
    records.sort_by_key(|record| record.sequence);
    let first_steps: Vec<_> = records
        .iter()
        .map(|record| lgvi_msgs::cdr::decode::<ControlSequence>(&record.data).unwrap())
        .map(|sequence| sequence.first_step)
        .collect();
    let controls = recording.messages::<Intervention>(INTERVENTION)[0].controls as usize;
    let (first, again) = first_steps.split_at(controls);
    assert_eq!(first[..4], [&[0], &*planned].concat());
    assert!(again.len() > 1, "nothing was planned anew: {first_steps:?}");
    assert!(again[0] == 0 && again[1] < planned[2], "{first_steps:?}");
    // A plan for the course before the reset would begin later than those that are made next.
    assert!(again.is_sorted_by(|a, b| a < b), "{first_steps:?}");
    let verdict = world.verify(&bag, 0);
    assert!(verdict.difference.is_none(), "{verdict:?}");
    // As near as without a reset.
    let miss = summary.flight.unwrap().miss.unwrap().norm;
    assert!(miss < 5e-3, "{miss}");
}
