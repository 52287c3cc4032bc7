//! The encoding of every message type against that of ROS 2 Jazzy.

use std::collections::BTreeMap;

use lgvi_msgs::{RosMessage, cdr};
use lgvi_tests::World;
use serde::Deserialize;
use serde_json::Value;

/// Samples of each type, of values that the type's name determines.
const COUNT: &str = "4";

/// What we align with; ROS 2 does so with whatever lies in its memory. Zeros that are values are compared when read.
const PADDING: u8 = 0;

/// A line of `ros2_samples.py`.
#[derive(Deserialize)]
struct Sample {
    r#type: String,
    value: Value,
    /// With room to spare at its end: `rclpy` serializes into as much as a message may take, and sends less.
    cdr: String,
}

fn bytes(hexadecimal: &str) -> Vec<u8> {
    let digits = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    hexadecimal.as_bytes().chunks(2).map(digits).collect()
}

/// The same values are written as the same bytes, and read from those of ROS 2.
fn agrees<M: RosMessage>(Sample { value, cdr, .. }: &Sample) {
    let name = M::TYPE_NAME;
    let message: M = serde_json::from_value(value.clone()).expect(name);
    let ours = cdr::encode(&message).unwrap();
    let theirs = bytes(cdr);
    let theirs = theirs.get(..ours.len()).expect(name);
    let mut pairs = ours.iter().zip(theirs);
    let same = pairs.all(|(ours, theirs)| ours == theirs || *ours == PADDING);
    assert!(same, "{name}: {value}");
    let read: M = cdr::decode(theirs).unwrap_or_else(|error| panic!("{error}: {value}"));
    assert_eq!(&serde_json::to_value(&read).unwrap(), value, "{name}");
}

type Check = fn(&Sample);

macro_rules! checks {
    ($($message:ty),* $(,)?) => {
        [$((<$message as RosMessage>::TYPE_NAME, agrees::<$message> as Check)),*]
    };
}

#[test]
fn every_message_is_encoded_and_decoded_as_in_ros_2() {
    let checks = BTreeMap::from(lgvi_msgs::for_every_message!(checks));
    assert_eq!(checks.len(), lgvi_msgs::message_types().len());
    let world = World::new();
    let mut arguments = vec!["--count", COUNT];
    arguments.extend(checks.keys());
    let samples = world.ros_python("ros2_samples.py", &arguments);
    let mut checked: BTreeMap<String, usize> = BTreeMap::new();
    for line in samples.finish().expect(0).stdout.lines() {
        let sample: Sample = serde_json::from_str(line).unwrap();
        checks[&*sample.r#type](&sample);
        *checked.entry(sample.r#type).or_default() += 1;
    }
    assert_eq!(checked.len(), checks.len());
    assert!(checked.values().all(|count| count.to_string() == COUNT));
}
