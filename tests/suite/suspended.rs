//! Processes that are stopped for a while, as by Ctrl-Z.
//!
//! Only of what it takes from shared memory does a recorder lose nothing: RustDDS ends its threads when a stopped process
//! goes on.

use std::ffi::OsStr;
use std::thread;
use std::time::Duration;

use lgvi_common::Event;
use lgvi_middleware::shm::Delivery;
use lgvi_tests::{Sender, Signal, World, coast, edited, eventually, publish, scene, state_numbers};
use serde_json::{Value, json};

/// How long the recorder is stopped.
const STOPPED: Duration = Duration::from_secs(3);

/// Shared memory has room for a quarter of them.
const STATES: u64 = 24_576;

const SCENE: &str = "/lgvi_propagator/scene";
const STATE: &str = "/lgvi_propagator/state";

const TOPIC: &str = "/suspended/state";

#[test]
fn a_recorder_that_is_stopped_for_three_seconds_loses_no_state() {
    let world = World::new();
    let delivery = Delivery::Lossless {
        patience: 10 * STOPPED,
    };
    let mut sender = Sender::new(&world, &[TOPIC.to_owned()], delivery);
    let bag = world.path("bag");
    let parameters = [
        &format!("output:={}", bag.display()),
        &format!("states:=['{TOPIC}']"),
        "topics:=[]",
    ];
    let recorder = world.node("recorder", &parameters);
    recorder.await_ready();
    for _ in 0..STATES / 4 {
        sender.send();
    }
    recorder.suspend();
    thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(STOPPED);
            recorder.signal(Signal::SIGCONT);
        });
        for _ in STATES / 4..STATES {
            sender.send();
        }
    });
    let [.., last] = sender.sent() else {
        panic!("nothing was sent");
    };
    let waited = last.duration_since(sender.sent()[STATES as usize / 4]);
    assert!(waited >= STOPPED / 2, "sent all within {waited:?}");
    recorder.await_event("all states", |event| match event {
        Event::Recording { messages, .. } => (messages.get(TOPIC) == Some(&STATES)).then_some(()),
        _ => None,
    });
    recorder.stop().expect(0);
    assert_eq!(state_numbers(&bag), (0..STATES).collect::<Vec<_>>());
}

/// Fast DDS reads it from the directory that it runs in; its own lease is 20 s.
const PROFILE: &str = r#"<?xml version="1.0"?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <participant profile_name="short_lease" is_default_profile="true">
    <rtps><builtin><discovery_config>
      <leaseDuration><sec>10</sec></leaseDuration>
      <leaseAnnouncement><sec>2</sec></leaseAnnouncement>
    </discovery_config></builtin></rtps>
  </participant>
</profiles>"#;

/// Longer than that, and than RustDDS takes to see that it has run out.
const PAST_LEASE: Duration = Duration::from_secs(20);

/// One comes every second.
const ODOMETRIES: &str = "30";

#[test]
fn a_subscription_of_ros_2_that_is_stopped_for_longer_than_its_lease_misses_nothing() {
    let world = World::new();
    std::fs::write(world.path("DEFAULT_FASTRTPS_PROFILES.xml"), PROFILE).unwrap();
    let parameters = [
        &format!("scene:={}", scene("free_body").display()),
        "real_time_factor:=1.0",
    ];
    let propagator = world.node("propagator", &parameters);
    let arguments = ["/lgvi_propagator/odometry/body", "--count", ODOMETRIES];
    let listener = world.ros_python("ros2_listener.py", &arguments);
    eventually("the first odometry", || {
        listener.stdout().contains("hears").then_some(())
    });
    listener.suspend();
    thread::sleep(PAST_LEASE);
    listener.signal(Signal::SIGCONT);
    let heard = listener.finish().expect(0).stdout;
    let told: Value = serde_json::from_str(heard.lines().last().unwrap()).unwrap();
    assert_eq!(told["steps"], json!([1_000_000_000]), "{heard}");
    propagator.stop().expect(0);
}

/// Steps of a flight of 9 s in real time.
const STEPS: usize = 100_000;

/// What it has missed meanwhile may be controls, as is told where they have an effect.
#[test]
fn a_flight_whose_recorder_was_stopped_is_not_said_to_differ() {
    let world = World::new();
    let bag = world.path("bag");
    let recorder = world.node("recorder", &[&format!("output:={}", bag.display())]);
    recorder.await_ready();
    let steps = format!("steps = {STEPS}");
    let scene = edited(&world, "inclination_change", &[("steps = 1000", &steps)]);
    let scene = format!("scene:={}", scene.display());
    let propagator = world.node(
        "propagator",
        &[&scene, "await_control:=false", "real_time_factor:=0.1"],
    );
    let has_reached = |step: u64| {
        propagator.await_event("a later step", |event| match event {
            Event::Flying { step: now } => (*now > step).then_some(()),
            _ => None,
        });
    };
    recorder.await_event("scene and states", |event| match event {
        Event::Recording { messages, .. } => [SCENE, STATE]
            .iter()
            .all(|topic| messages.contains_key(*topic))
            .then_some(()),
        _ => None,
    });
    recorder.suspend();
    let mut sequence = coast();
    sequence.first_step = STEPS as u64 / 2;
    sequence.step_size *= 1000.0 / STEPS as f64;
    sequence.force[0].x = 1.0;
    let stranger = world.ros_node("stranger");
    let _publisher = publish(&stranger, &sequence);
    propagator.await_stderr("flying a control sequence");
    // More than shared memory has room for.
    has_reached(STEPS as u64 / 2 + 10_000);
    recorder.signal(Signal::SIGCONT);
    propagator.await_flown();
    propagator.stop().expect(0);
    recorder.stop();
    let verify = [OsStr::new("verify"), bag.as_os_str(), OsStr::new("--json")];
    let verified = world.lgvi(verify).finish();
    let verdict: Value = verified.json();
    assert!(verdict["missing"].as_u64() > Some(0), "{verdict}");
    let outcome = if verdict["sequences"] == 0 {
        "incomplete"
    } else {
        "agrees"
    };
    assert_eq!(verdict["outcome"], outcome, "{verdict}");
    assert_eq!(verified.code, Some(i32::from(outcome == "incomplete")));
}
