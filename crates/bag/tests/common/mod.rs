//! Topics and messages of the tests.

#![allow(dead_code, reason = "no test uses all of it")]

use std::path::Path;

use lgvi_bag::{BagError, BagReader, Qos, Topic};
use lgvi_msgs::{RosMessage, cdr, std_msgs::String as StringMessage};

pub fn topic(name: &str, qos: Qos) -> Topic {
    Topic {
        name: name.to_owned(),
        type_name: StringMessage::TYPE_NAME.to_owned(),
        type_hash: StringMessage::TYPE_HASH.to_owned(),
        definition: StringMessage::DEFINITION.to_owned(),
        qos,
    }
}

/// About 100 bytes that differ for every number and do not compress to nothing.
pub fn payload(number: u32) -> Vec<u8> {
    let words = (0..5).map(|word| format!("{:016x}", random(u64::from(number) * 5 + word)));
    cdr::encode(&StringMessage {
        data: words.collect::<Vec<_>>().join(" "),
    })
    .unwrap()
}

/// SplitMix64.
pub fn random(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A message without its topic.
#[derive(Debug, PartialEq, Eq)]
pub struct Read {
    pub topic: String,
    pub log_time: u64,
    pub publish_time: u64,
    pub sequence: u32,
    pub data: Vec<u8>,
}

pub fn read_all(path: &Path) -> Result<Vec<Read>, BagError> {
    let bag = BagReader::open(path)?;
    bag.messages()
        .map(|message| {
            message.map(|message| Read {
                topic: message.topic.name.clone(),
                log_time: message.log_time,
                publish_time: message.publish_time,
                sequence: message.sequence,
                data: message.data,
            })
        })
        .collect()
}
