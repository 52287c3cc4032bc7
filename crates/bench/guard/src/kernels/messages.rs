//! States on their way into a bag.

use std::collections::BTreeMap;
use std::hint::black_box;

use lgvi_bag::{BagOptions, BagWriter, Compression, Qos, ROS2MSG, Topic, TopicId};
use lgvi_msgs::msg::{BodyState, SystemState};
use lgvi_msgs::{RosMessage, cdr};
use tempfile::TempDir;

use super::{CALLS, Kernel};

/// About 300 B.
fn state() -> SystemState {
    let body = |name: &str| BodyState {
        name: name.to_owned(),
        position: [1.0, 2.0, 3.0],
        linear_momentum: [0.1, 0.2, 0.3],
        attitude: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        angular_momentum: [0.5, 0.6, 0.7],
    };
    SystemState {
        bodies: vec![body("one"), body("other")],
        ..SystemState::default()
    }
}

fn state_and_room() -> (SystemState, Vec<u8>) {
    (state(), Vec::with_capacity(1 << 12))
}

fn encode((state, bytes): &mut (SystemState, Vec<u8>)) -> usize {
    let mut written = 0;
    for _ in 0..CALLS {
        bytes.clear();
        cdr::encode_into(bytes, black_box(state)).expect("a message");
        written += black_box(&*bytes).len();
    }
    written
}

/// A bag without compression, whose every chunk holds a hundred messages.
struct Bag {
    writer: BagWriter,
    topic: TopicId,
    message: Vec<u8>,
    _folder: TempDir,
}

fn bag() -> Bag {
    let folder = tempfile::tempdir().expect("a folder");
    let message = cdr::encode(&state()).expect("a message");
    let options = BagOptions {
        compression: Compression::None,
        ..BagOptions::default()
    };
    let mut writer = BagWriter::create(&folder.path().join("bag"), options).expect("a bag");
    let topic = Topic {
        name: "/state".to_owned(),
        type_name: SystemState::TYPE_NAME.to_owned(),
        type_hash: SystemState::TYPE_HASH.to_owned(),
        definition: SystemState::DEFINITION.to_owned(),
        definition_encoding: ROS2MSG.to_owned(),
        qos: Qos::default(),
    };
    let topic = writer.add_topic(&topic).expect("a topic");
    Bag {
        writer,
        topic,
        message,
        _folder: folder,
    }
}

/// Ends with the chunk, its index and the bag's description.
fn write(bag: &mut Option<Bag>) -> u64 {
    let Bag {
        mut writer,
        topic,
        message,
        _folder,
    } = bag.take().expect("written once");
    for sequence in 0..CALLS {
        let time = u64::from(sequence);
        writer
            .write(topic, time, time, sequence, black_box(&message))
            .expect("a message");
    }
    writer.finish(BTreeMap::new()).expect("a bag").bytes
}

pub(super) fn kernels() -> Vec<Kernel> {
    vec![
        Kernel::new("messages", "cdr_of_a_state", state_and_room, encode),
        Kernel::new("messages", "bag_of_a_chunk", || Some(bag()), write),
    ]
}
