//! Control sequences with a feedback law, from strangers, under a disturbance.

use std::path::{Path, PathBuf};

use lgvi_common::{Event, FlightReport};
use lgvi_middleware::ros::SampleId;
use lgvi_middleware::shm::{ControlPublisher, ShmNode, ShmOptions};
use lgvi_msgs::cdr;
use lgvi_msgs::msg::{ControlSequence, SystemState};
use lgvi_msgs::shm::ControlHeader;
use lgvi_tests::{PATIENCE, Process, Recording, Summary, World, edited, publish, scene};

const FLOWN: &str = "/lgvi_propagator/flown_control";
const STATE: &str = "/lgvi_propagator/state";
const CONTROL: &str = "/lgvi_propagator/control_sequence";

/// A copy of the scene whose flight is not what was planned.
fn disturbed(world: &World) -> PathBuf {
    let disturbance = "[maneuver]\n";
    let with = "[disturbance]\nseed = 5\nforce_error = 0.01\nmoment_error = 0.01\nposition = 1e-3\nvelocity = 1e-3\n\
                attitude = 1e-2\nangular_velocity = 1e-2\n\n[maneuver]\n";
    edited(world, "inclination_change", &[(disturbance, with)])
}

/// The plan of the scene, flown undisturbed, with a law that pulls the body to it.
fn law(world: &World) -> ControlSequence {
    let (_, bag) = world.fly(&scene("inclination_change"), "plan");
    let flight = Recording::read(&bag);
    let mut message = flight.messages::<ControlSequence>(FLOWN).pop().unwrap();
    let states = flight.messages::<SystemState>(STATE);
    let states = states.iter().take(message.force.len());
    message.reference = states.map(|state| state.bodies[0].clone()).collect();
    // Damped springs of 30 rad/s for mass 1 and inertia J.
    let rate: f64 = 30.0;
    let inertia = [0.009, 0.0315, 0.0315];
    let mut gain = [[0.0; 12]; 6];
    for axis in 0..3 {
        gain[axis][axis] = rate * rate;
        gain[axis][3 + axis] = 2.0 * rate;
        gain[3 + axis][6 + axis] = rate * rate * inertia[axis];
        gain[3 + axis][9 + axis] = 2.0 * rate;
    }
    message.feedback = gain.as_flattened().repeat(message.force.len());
    message
}

/// Sends a sequence over shared memory to the propagator, once it is there; keep the publisher.
fn send(world: &World, message: &ControlSequence, header: ControlHeader) -> ControlPublisher {
    let options = ShmOptions {
        domain_id: world.environment().domain_id,
        root: Some(world.path("shm")),
    };
    let node = ShmNode::new("stranger", &options).unwrap();
    let mut publisher = node.control_publisher(CONTROL).unwrap();
    assert!(publisher.wait_for_subscribers(1, PATIENCE).unwrap());
    let cdr = cdr::encode(message).unwrap();
    let delivered = publisher.send(header, &cdr).unwrap();
    assert_eq!((delivered.receivers, delivered.refused), (1, 0));
    publisher
}

/// That of a sequence that is sent over shared memory only.
const ALONE: ControlHeader = ControlHeader {
    publisher: [0; 16],
    number: 0,
};

/// Flies the scene with a sequence, over shared memory where it has a law, else over DDS; its report and its bag.
fn fly(
    world: &World,
    scene: &Path,
    message: &ControlSequence,
    bag: &str,
) -> (FlightReport, PathBuf) {
    let flight = world.start_flight(scene, bag, &["--no-planner", "--no-plot"]);
    let stranger = world.ros_node("stranger");
    let has_law = !message.feedback.is_empty();
    let _shm = has_law.then(|| send(world, message, ALONE));
    let _ros = (!has_law).then(|| publish(&stranger, message));
    let summary: Summary = flight.finish().expect(0).json();
    (summary.flight.unwrap(), summary.bag.unwrap())
}

#[test]
fn a_law_corrects_the_flight_and_verifies() {
    let world = World::new();
    let law = law(&world);
    let scene = disturbed(&world);
    let (closed, bag) = fly(&world, &scene, &law, "closed");
    let flown = Recording::read(&bag).messages::<ControlSequence>(FLOWN);
    assert!(flown == [law.clone()], "{} sequences", flown.len());
    world.verify_agrees(&bag, 1001);

    // The law is part of what was flown: a bit of a gain is seen.
    let mut altered = Recording::read(&bag);
    altered.edit(FLOWN, 0, |flown: &mut ControlSequence| {
        flown.feedback[400 * 72] *= 1.0 + 1e-9;
    });
    altered.write(&world.path("altered"));
    let difference = world.verify(&world.path("altered"), 1).difference.unwrap();
    assert_eq!(difference.step, 401);

    let open = ControlSequence {
        reference: Vec::new(),
        feedback: Vec::new(),
        ..law
    };
    let (open, bag) = fly(&world, &scene, &open, "open");
    world.verify_agrees(&bag, 1001);
    let (closed, open) = (closed.miss.unwrap(), open.miss.unwrap());
    assert!(open.norm > 1e-2, "{open:?}");
    assert!(closed.norm < 0.1 * open.norm, "{closed:?} against {open:?}");
}

#[test]
fn a_law_that_comes_by_two_ways_counts_once() {
    let world = World::new();
    let mut law = law(&world);
    // It starts late enough for both to come in time.
    let start = 500;
    law.first_step = start as u64;
    law.force.drain(..start);
    law.moment.drain(..start);
    law.reference.drain(..start);
    law.feedback.drain(..72 * start);
    let arguments = ["--no-planner", "--no-plot", "--real-time-factor", "0.2"];
    let flight = world.start_flight(&disturbed(&world), "flight", &arguments);
    let stranger = world.ros_node("stranger");
    let ros = publish(&stranger, &law);
    let sample = SampleId {
        sequence: 1,
        ..ros.next_sample()
    };
    let header = ControlHeader {
        publisher: sample.writer.0,
        number: sample.sequence.unsigned_abs(),
    };
    let _shm = send(&world, &law, header);
    let summary: Summary = flight.finish().expect(0).json();
    let bag = summary.bag.unwrap();
    let flown = Recording::read(&bag).messages::<ControlSequence>(FLOWN);
    assert!(flown == [law], "{} sequences", flown.len());
    world.verify_agrees(&bag, 1001);
}

/// Steps flown.
fn await_end(propagator: &Process) -> u64 {
    propagator.await_flown().steps
}

#[test]
fn without_feedback_the_sequence_is_flown_and_recorded_in_open_loop() {
    let world = World::new();
    let law = law(&world);
    let bag = world.path("flight");
    let output = format!("output:={}", bag.display());
    let topics = "topics:=[/lgvi_propagator/scene=lgvi_msgs/msg/Scene, \
                  /lgvi_propagator/flown_control=lgvi_msgs/msg/ControlSequence, \
                  /lgvi_propagator/invariants=lgvi_msgs/msg/Invariants]";
    let recorder = world.node("recorder", &[&output, topics, "log_time:=stamp"]);
    recorder.await_ready();
    let scene = format!("scene:={}", disturbed(&world).display());
    let parameters = [&scene, "real_time_factor:=0.0", "feedback:=false"];
    let propagator = world.node("propagator", &parameters);
    propagator.await_ready();
    let _shm = send(&world, &law, ALONE);
    assert_eq!(await_end(&propagator), 1000);
    recorder.await_event("scene and sequence recorded", |event| match event {
        Event::Recording { messages, .. } => {
            let recorded = |topic| messages.contains_key(topic);
            (recorded(FLOWN) && recorded("/lgvi_propagator/scene")).then_some(())
        }
        _ => None,
    });
    propagator.stop().expect(0);
    recorder.stop().expect(0);
    let flown = Recording::read(&bag).messages::<ControlSequence>(FLOWN);
    let [flown] = &flown[..] else {
        panic!("{} sequences", flown.len())
    };
    assert!(flown.reference.is_empty() && flown.feedback.is_empty());
    assert_eq!(flown.force, law.force);
    world.verify_agrees(&bag, 1001);
}

#[test]
fn a_malformed_law_ends_the_flight_with_the_field_named() {
    let world = World::new();
    let mut law = law(&world);
    law.feedback[73] = f64::NAN;
    let flight = world.start_flight(&scene("inclination_change"), "flight", &["--no-planner"]);
    let _shm = send(&world, &law, ALONE);
    let finished = flight.finish().expect(2);
    finished.says(&["`feedback[73]` is NaN", "expected a finite number"]);
}

#[test]
fn a_bag_with_the_sequences_of_an_earlier_version_is_refused_with_a_reason() {
    let world = World::new();
    let (_, bag) = world.fly(&scene("inclination_change"), "flight");
    let mut flight = Recording::read(&bag);
    let record = flight
        .records
        .iter_mut()
        .find(|record| record.topic == FLOWN);
    let data = &mut record.unwrap().data;
    // Two empty lists, eight limits, a flag and two empty lists came later.
    data.truncate(data.len() - (2 * 4 + 8 * 8 + 12));
    assert!(cdr::decode::<ControlSequence>(data).is_err());
    for topic in &mut flight.topics {
        if topic.name == FLOWN {
            topic.type_hash =
                "RIHS01_9648e05d8e1355ee24359805b37174c3b4c7e22ae0d03baaa6694ef472f79597".into();
        }
    }
    let old = world.path("old");
    flight.write(&old);
    let verify = world.lgvi(["verify".as_ref(), old.as_os_str()]);
    verify.finish().expect(2).says(&[
        old.to_str().unwrap(),
        FLOWN,
        "lgvi_msgs/msg/ControlSequence",
        "another definition",
    ]);
}
