//! Numbered states in shared memory, which show what a recorder has lost.

use std::path::Path;
use std::time::Instant;

use lgvi_bag::BagReader;
use lgvi_middleware::shm::{Delivery, ShmNode, ShmPublisher, State};
use lgvi_msgs::cdr;
use lgvi_msgs::msg::SystemState;
use lgvi_msgs::shm::{BodySample, Name, StateHeader};

use crate::{World, settled};

/// Sends the same states on several topics.
pub struct Sender {
    _node: ShmNode,
    publishers: Vec<ShmPublisher<State>>,
    sent: Vec<Instant>,
}

impl Sender {
    /// A sender in this process.
    pub fn new(world: &World, topics: &[String], delivery: Delivery) -> Self {
        let node = world.shm_node("numbered_states");
        let publisher = |topic: &String| node.state_publisher(topic, 1, delivery).expect(topic);
        Self {
            publishers: topics.iter().map(publisher).collect(),
            _node: node,
            sent: Vec::new(),
        }
    }

    /// Sends the next state on all topics.
    pub fn send(&mut self) {
        let number = self.sent.len() as u64;
        let header = StateHeader {
            sequence: number,
            step: number,
            time: number as f64 * 2e-3,
            stamp_nanoseconds: number.cast_signed() * 2_000_000,
        };
        for publisher in &mut self.publishers {
            publisher
                .send(header, &[body(number)])
                .expect("a state sent");
        }
        self.sent.push(Instant::now());
    }

    /// When each state had been sent.
    pub fn sent(&self) -> &[Instant] {
        &self.sent
    }
}

/// Waits until states come no more: their publisher waits for a subscriber that is suspended.
#[track_caller]
pub fn await_stall(world: &World, topic: &str) {
    let node = world.shm_node("observer");
    let mut states = node.state_subscriber(topic, 8192).expect("a subscriber");
    let mut latest = None;
    settled(|| {
        while let Some(state) = states.receive().expect("a state") {
            latest = Some(state.header().sequence);
        }
        latest
    });
}

/// The numbers of a bag's states, each of which must be as it was sent.
#[track_caller]
pub fn state_numbers(bag: &Path) -> Vec<u64> {
    let reader = BagReader::open(bag).expect("a bag");
    let messages = reader.messages().map(|message| {
        let message = message.expect("a message");
        let state: SystemState = cdr::decode(&message.data).expect("a state");
        let [recorded] = &state.bodies[..] else {
            panic!("{state:?}");
        };
        assert_eq!(recorded.position, body(state.sequence).position);
        state.sequence
    });
    messages.collect()
}

fn body(number: u64) -> BodySample {
    BodySample {
        name: Name::try_from("body").expect("a name"),
        position: [number as f64, 1.0 / (1 + number) as f64, -0.0],
        ..BodySample::default()
    }
}
