//! Processes that are stopped for a while, as by Ctrl-Z.
//!
//! Only of what it takes from shared memory does a recorder lose nothing: RustDDS ends its threads when a stopped process
//! goes on.

use std::thread;
use std::time::Duration;

use lgvi_middleware::shm::Delivery;
use lgvi_node::Event;
use lgvi_tests::{Sender, Signal, World, eventually, scene, state_numbers};
use serde_json::{Value, json};

/// How long the recorder is stopped.
const STOPPED: Duration = Duration::from_secs(3);

/// Shared memory has room for a quarter of them.
const STATES: u64 = 24_576;

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
