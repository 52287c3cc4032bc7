//! States go over shared memory, too.

use lgvi_bag::Topic;
use lgvi_common::Event;
use lgvi_msgs::msg::{BodyState, SystemState};
use lgvi_msgs::rcl_interfaces::srv::{SetParameters, SetParametersRequest};
use lgvi_msgs::rcl_interfaces::{Parameter, ParameterValue};
use lgvi_msgs::rosbag2_interfaces::srv::{PlayNext, PlayNextRequest, Resume, ResumeRequest};
use lgvi_msgs::std_msgs::Header;
use lgvi_msgs::{RosMessage, cdr};
use lgvi_tests::{Record, Recording, Signal, World, await_stall};

use super::{START, STEP, recorded_again, topic};

const STATE: &str = "/lgvi_propagator/state";

/// The type of a parameter that is a number.
const DOUBLE: u8 = 3;

/// States, of which each has so many bodies.
fn states(count: u64, bodies: impl Fn(u64) -> u64) -> Recording {
    let records = (0..count).map(|number| {
        let body = BodyState {
            name: "body".into(),
            attitude: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            ..BodyState::default()
        };
        let header = Header {
            frame_id: "inertial".into(),
            ..Header::default()
        };
        let message = SystemState {
            header,
            sequence: number,
            step: number,
            bodies: vec![body; usize::try_from(bodies(number)).unwrap()],
            ..SystemState::default()
        };
        Record {
            topic: STATE.into(),
            log_time: START + number * STEP,
            publish_time: START,
            sequence: 0,
            data: cdr::encode(&message).unwrap(),
        }
    });
    Recording {
        topics: vec![Topic {
            type_name: SystemState::TYPE_NAME.into(),
            type_hash: SystemState::TYPE_HASH.into(),
            definition: SystemState::DEFINITION.into(),
            ..topic(STATE, false)
        }],
        records: records.collect(),
    }
}

#[test]
fn states_of_more_bodies_than_the_first_go_over_shared_memory_and_those_of_another_definition_do_not()
 {
    let world = World::new();
    let mut bag = states(60, |number| 1 + number / 20);
    bag.write(&world.path("bag"));
    let copy = recorded_again(&world);
    let payloads = |bag: &Recording| Vec::from_iter(bag.on(STATE).map(|one| one.data.clone()));
    assert!(payloads(&copy) == payloads(&bag), "{:?}", copy.counts());

    bag.topics[0].type_hash = format!("RIHS01_{}", "0".repeat(64));
    bag.write(&world.path("other"));
    let other = world.path("other");
    let played = world.lgvi(["play", other.to_str().unwrap(), "--rate", "0"]);
    played
        .finish()
        .expect(0)
        .says(&[STATE, "does not go over shared memory"]);
}

#[test]
fn nothing_is_lost_once_the_rate_is_0() {
    // Shared memory has room for a third of them.
    const COUNT: u64 = 24_576;
    let world = World::new();
    states(COUNT, |_| 1).write(&world.path("bag"));
    let output = format!("output:={}", world.path("copy").display());
    let topics = ["topics:=[]", "states:=['/lgvi_propagator/state']"];
    let recorder = world.node("recorder", &[&output, topics[0], topics[1]]);
    recorder.await_ready();
    let bag = format!("bag:={}", world.path("bag").display());
    let parameters = [&bag, "start_paused:=true", "await_subscribers:=1"];
    let process = world.node("player", &parameters);
    process.await_ready();
    let player = world.operator("lgvi_player");
    let next = player.call::<PlayNext>("play_next", &PlayNextRequest::default());
    assert!(next.success);
    let await_states = |count: u64| {
        recorder.await_event(&format!("{count} states"), |event| match event {
            Event::Recording { messages, .. } => {
                (messages.get(STATE) == Some(&count)).then_some(())
            }
            _ => None,
        });
    };
    await_states(1);
    let rate = Parameter {
        name: "rate".into(),
        value: ParameterValue {
            r#type: DOUBLE,
            ..ParameterValue::default()
        },
    };
    let parameters = vec![rate];
    let set = player.call::<SetParameters>("set_parameters", &SetParametersRequest { parameters });
    assert!(set.results[0].successful, "{set:?}");
    recorder.suspend();
    player.call::<Resume>("resume", &ResumeRequest::default());
    await_stall(&world, STATE);
    recorder.signal(Signal::SIGCONT);
    process.finish().expect(0);
    await_states(COUNT);
    recorder.stop().expect(0);
    let copy: Vec<SystemState> = Recording::read(&world.path("copy")).messages(STATE);
    assert!(copy.iter().map(|state| state.sequence).eq(0..COUNT));
}
