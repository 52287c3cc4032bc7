//! Topics and messages of the tests.

#![allow(dead_code, reason = "no test uses all of it")]
#![allow(clippy::unwrap_used)]

use std::{collections::BTreeMap, fs, ops::Range, path::Path};

use lgvi_bag::{BagError, BagReader, BagWriter, Qos, Topic};
use lgvi_msgs::{RosMessage, cdr, std_msgs::String as StringMessage};
use mcap::{MessageStream, Summary};

pub fn topic(name: &str, qos: Qos) -> Topic {
    Topic {
        name: name.to_owned(),
        type_name: StringMessage::TYPE_NAME.to_owned(),
        type_hash: StringMessage::TYPE_HASH.to_owned(),
        definition: StringMessage::DEFINITION.to_owned(),
        definition_encoding: lgvi_bag::ROS2MSG.to_owned(),
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

/// Places of a file's chunks.
pub fn chunks(bytes: &[u8]) -> Vec<Range<usize>> {
    let mut chunks = Vec::new();
    let mut start = mcap::MAGIC.len();
    while let Some((prefix, _)) = bytes[start..].split_first_chunk::<9>() {
        let [opcode, length @ ..] = *prefix;
        let end = start + prefix.len() + u64::from_le_bytes(length) as usize;
        if opcode == mcap::records::op::CHUNK {
            chunks.push(start..end);
        }
        if opcode == mcap::records::op::FOOTER {
            break;
        }
        start = end;
    }
    chunks
}

/// Leaves a bag as a recorder that is killed does: its last file without end, and no `metadata.yaml`.
pub fn kill(writer: BagWriter) {
    let file = writer.path();
    let bytes = fs::read(&file).unwrap();
    // Closes the bag.
    drop(writer);
    fs::write(&file, bytes).unwrap();
    let _ = fs::remove_file(file.with_file_name("metadata.yaml"));
}

/// Names and contents of the metadata records of a file that may be without its end.
pub fn metadata_records(path: &Path) -> Vec<(String, BTreeMap<String, String>)> {
    let bytes = fs::read(path).unwrap();
    let mut left = &bytes[mcap::MAGIC.len()..];
    let mut found = Vec::new();
    while let Some(([opcode, length @ ..], rest)) = left.split_first_chunk::<9>() {
        let (body, rest) = rest.split_at(u64::from_le_bytes(*length) as usize);
        if *opcode == mcap::records::op::METADATA
            && let mcap::records::Record::Metadata(record) =
                mcap::parse_record(*opcode, body).unwrap()
        {
            found.push((record.name, record.metadata));
        }
        if *opcode == mcap::records::op::FOOTER {
            break;
        }
        left = rest;
    }
    found
}

/// A message without its topic.
#[derive(Clone, Debug, PartialEq, Eq)]
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

/// A topic of which late joiners get the last messages.
pub fn latched(name: &str, depth: u32) -> Topic {
    let qos = Qos {
        durable: true,
        depth,
        ..Qos::default()
    };
    topic(name, qos)
}

/// An MCAP file as the crate mcap reads it, with its checksums.
pub struct McapFile {
    /// In the order of the file.
    pub messages: Vec<Read>,
    pub summary: Summary,
    /// Names and contents of the metadata records.
    pub metadata: Vec<(String, BTreeMap<String, String>)>,
}

impl McapFile {
    pub fn read(path: &Path) -> Self {
        let bytes = fs::read(path).unwrap();
        let options = mcap::sans_io::LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true);
        let mut reader = mcap::sans_io::LinearReader::new_with_options(options);
        let mut left = &bytes[..];
        while let Some(event) = reader.next_event() {
            if let mcap::sans_io::LinearReadEvent::ReadRequest(length) = event.unwrap() {
                let length = length.min(left.len());
                reader.insert(length).copy_from_slice(&left[..length]);
                reader.notify_read(length);
                left = &left[length..];
            }
        }
        let summary = Summary::read(&bytes).unwrap().unwrap();
        let messages = MessageStream::new(&bytes).unwrap().map(|message| {
            let message = message.unwrap();
            Read {
                topic: message.channel.topic.clone(),
                log_time: message.log_time,
                publish_time: message.publish_time,
                sequence: message.sequence,
                data: message.data.into_owned(),
            }
        });
        let metadata = summary.metadata_indexes.iter().map(|index| {
            let record = mcap::read::metadata(&bytes, index).unwrap();
            (record.name, record.metadata)
        });
        Self {
            messages: messages.collect(),
            metadata: metadata.collect(),
            summary,
        }
    }

    /// How many messages of each topic are repeated.
    pub fn repeated(&self) -> BTreeMap<String, usize> {
        let records = self.metadata.iter();
        let mut records = records.filter(|(name, _)| name == "lgvi_repeated");
        let Some((_, counts)) = records.next() else {
            return BTreeMap::new();
        };
        assert!(records.next().is_none(), "two lgvi_repeated records");
        let counts = counts.iter();
        counts
            .map(|(topic, count)| (topic.clone(), count.parse().unwrap()))
            .collect()
    }

    /// The messages that are not repeated.
    pub fn own(self) -> Vec<Read> {
        let mut repeated = self.repeated();
        let mut messages = self.messages;
        messages.retain(|message| {
            let left = repeated.get_mut(&message.topic);
            let Some(left) = left.filter(|left| **left > 0) else {
                return true;
            };
            *left -= 1;
            false
        });
        messages
    }

    /// What rosbag2 writes into the file of its `metadata.yaml`.
    pub fn rosbag2(&self) -> serde_yaml_ng::Value {
        let (_, record) = self.metadata.last().unwrap();
        serde_yaml_ng::from_str(&record["serialized_metadata"]).unwrap()
    }
}

/// What `metadata.yaml` holds.
pub fn metadata(bag: &Path) -> serde_yaml_ng::Value {
    let text = fs::read_to_string(bag.join("metadata.yaml")).unwrap();
    let document: serde_yaml_ng::Value = serde_yaml_ng::from_str(&text).unwrap();
    document["rosbag2_bagfile_information"].clone()
}
