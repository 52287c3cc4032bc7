//! Bags that earlier versions have made, or earlier versions of rosbag2, are read today as they were read then.
//!
//! Beside each bag in `bags/earlier` lies what was read of it when it was put there, by topic. Types of messages may change:
//! what was recorded does not.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use lgvi_bag::{BagReader, Qos};
use lgvi_tests::{Recording, World, earlier_bags};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

const STATE: &str = "/lgvi_propagator/state";

/// What a bag holds.
#[derive(Debug, Deserialize, PartialEq, Serialize)]
struct Contents {
    /// Whether its states are those that the arithmetic of today gives.
    verifies: bool,
    /// The bag's custom data.
    custom: BTreeMap<String, String>,
    topics: BTreeMap<String, Held>,
}

/// What it holds of a topic.
#[derive(Debug, Deserialize, PartialEq, Serialize)]
struct Held {
    r#type: String,
    hash: String,
    /// Reliability, durability, history and depth.
    qos: String,
    messages: u64,
    /// The first and the last log time.
    times: [u64; 2],
    /// SHA-256 of log time (8 bytes), length (8 bytes) and payload of each message, little-endian.
    sha256: String,
}

fn contents(bag: &Path, verifies: bool) -> Contents {
    let recording = Recording::read(bag);
    let held = recording.topics.iter().map(|topic| {
        let records: Vec<_> = recording.on(&topic.name).collect();
        let mut digest = Sha256::new();
        for record in &records {
            digest.update(record.log_time.to_le_bytes());
            digest.update((record.data.len() as u64).to_le_bytes());
            digest.update(&record.data);
        }
        let sha256 = digest
            .finalize()
            .iter()
            .fold(String::new(), |mut text, byte| {
                write!(text, "{byte:02x}").unwrap();
                text
            });
        let time =
            |record: Option<&&lgvi_tests::Record>| record.map_or(0, |record| record.log_time);
        let Qos {
            reliable,
            durable,
            history,
            depth,
        } = topic.qos;
        let reliability = if reliable { "Reliable" } else { "BestEffort" };
        let durability = if durable {
            "TransientLocal"
        } else {
            "Volatile"
        };
        let held = Held {
            r#type: topic.type_name.clone(),
            hash: topic.type_hash.clone(),
            qos: format!("{reliability}, {durability}, {history:?} {depth}"),
            messages: records.len() as u64,
            times: [time(records.first()), time(records.last())],
            sha256,
        };
        (topic.name.clone(), held)
    });
    Contents {
        verifies,
        custom: BagReader::open(bag).unwrap().custom().clone(),
        topics: held.collect(),
    }
}

#[test]
fn bags_of_earlier_versions_are_read_as_they_were() {
    let world = World::new();
    for bag in earlier_bags() {
        let file = bag.with_extension("json");
        let Ok(text) = fs::read_to_string(&file) else {
            let found = serde_json::to_string_pretty(&contents(&bag, true)).unwrap();
            panic!("{} is missing. Today it would be\n{found}", file.display());
        };
        let expected: Contents = serde_json::from_str(&text).unwrap();
        let found = contents(&bag, expected.verifies);
        for (topic, expected) in &expected.topics {
            assert_eq!(
                found.topics.get(topic),
                Some(expected),
                "{topic} of {}",
                bag.display()
            );
        }
        assert_eq!(found, expected, "{}", bag.display());
        let path = bag.to_str().unwrap();
        world.lgvi(["play", path, "--rate", "0"]).finish().expect(0);
        // What cannot be repeated any more can still be played.
        if expected.verifies {
            world.verify_agrees(&bag, expected.topics[STATE].messages);
        }
    }
}

/// The QoS of a topic as a text, as rosbag2 wrote it into `metadata.yaml` up to version 8: of Humble, and of Iron.
const QOS: [&str; 2] = [
    r#""- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n  deadline:\n    sec: 9223372036\n    nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n  avoid_ros_namespace_conventions: false""#,
    r#""- history: keep_last\n  depth: 10\n  reliability: reliable\n  durability: volatile\n  deadline:\n    sec: 9223372036\n    nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: automatic\n  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n  avoid_ros_namespace_conventions: false""#,
];

/// `metadata.yaml` of a bag of one file, as rosbag2 wrote it in a version of it.
fn metadata(version: u32, name: &str, recording: &Recording) -> String {
    let mut text = String::new();
    let times: Vec<_> = recording
        .records
        .iter()
        .map(|record| record.log_time)
        .collect();
    let (start, end) = (times[0], times[times.len() - 1]);
    let file = format!("{name}_0.mcap");
    let mut line = |at: usize, line: &str| writeln!(text, "{:at$}{line}", "").unwrap();
    let times = |line: &mut dyn FnMut(usize, &str), at: usize| {
        line(at, "duration:");
        line(at + 2, &format!("nanoseconds: {}", end - start));
        line(at, "starting_time:");
        line(at + 2, &format!("nanoseconds_since_epoch: {start}"));
    };
    line(0, "rosbag2_bagfile_information:");
    line(2, &format!("version: {version}"));
    line(2, "storage_identifier: mcap");
    // Until version 3 the path began with the bag's directory.
    let path = match version {
        ..4 => format!("{name}/{file}"),
        _ => file.clone(),
    };
    if version < 5 {
        line(2, "relative_file_paths:");
        line(4, &format!("- {path}"));
    }
    times(&mut line, 2);
    line(2, &format!("message_count: {}", recording.records.len()));
    line(2, "topics_with_message_count:");
    for topic in &recording.topics {
        line(4, "- topic_metadata:");
        line(8, &format!("name: {}", topic.name));
        line(8, &format!("type: {}", topic.type_name));
        line(8, "serialization_format: cdr");
        if version >= 4 {
            let qos = QOS[usize::from(version >= 7)];
            line(8, &format!("offered_qos_profiles: {qos}"));
        }
        if version >= 7 {
            line(8, &format!("type_description_hash: {}", topic.type_hash));
        }
        line(
            6,
            &format!("message_count: {}", recording.on(&topic.name).count()),
        );
    }
    if version >= 3 {
        line(2, "compression_format: \"\"");
        line(2, "compression_mode: \"\"");
    }
    if version >= 5 {
        line(2, "relative_file_paths:");
        line(4, &format!("- {path}"));
        line(2, "files:");
        line(4, &format!("- path: {path}"));
        times(&mut line, 6);
        line(6, &format!("message_count: {}", recording.records.len()));
    }
    if version >= 6 {
        line(2, "custom_data: ~");
    }
    if version >= 8 {
        line(2, "ros_distro: iron");
    }
    text
}

#[test]
fn metadata_of_all_versions_of_rosbag2_is_read() {
    let world = World::new();
    let recording =
        Recording::read(&earlier_bags()[0]).only(&["/tf", "/lgvi_propagator/invariants"]);
    for version in 1..=8 {
        let name = format!("version_{version}");
        let bag = world.path(&name);
        recording.write(&bag);
        fs::write(
            bag.join("metadata.yaml"),
            metadata(version, &name, &recording),
        )
        .unwrap();
        assert_eq!(Recording::read(&bag), recording, "version {version}");
    }

    let bag = world.path("version_10");
    recording.write(&bag);
    fs::write(
        bag.join("metadata.yaml"),
        metadata(10, "version_10", &recording),
    )
    .unwrap();
    let refused = BagReader::open(&bag).err().unwrap().to_string();
    assert!(refused.contains("10") && refused.contains('9'), "{refused}");
}

/// What metadata says is compared with the file, whatever its version.
#[test]
fn metadata_that_counts_otherwise_is_refused() {
    let world = World::new();
    let recording = Recording::read(&earlier_bags()[0]).only(&["/tf"]);
    for version in [1, 4, 8] {
        let name = format!("version_{version}");
        let bag = world.path(&name);
        recording.write(&bag);
        let text = metadata(version, &name, &recording);
        let wrong = text.replace("message_count: 101", "message_count: 102");
        assert_ne!(text, wrong);
        fs::write(bag.join("metadata.yaml"), wrong).unwrap();
        let refused = BagReader::open(&bag).err().unwrap().to_string();
        assert!(refused.contains("/tf"), "{refused}");
    }
}
