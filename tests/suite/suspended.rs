//! A recorder that is stopped for a while, as by Ctrl-Z.
//!
//! Only of what it takes from shared memory does it lose nothing: RustDDS ends its threads when a stopped process goes on.

use std::thread;
use std::time::Duration;

use lgvi_middleware::shm::Delivery;
use lgvi_node::Event;
use lgvi_tests::{Sender, Signal, World, state_numbers};

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
