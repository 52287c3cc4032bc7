//! Messages that a split bag repeats at the head of a further file are given out once.

use std::{collections::BTreeMap, fs, path::Path};

use crate::common::{payload, read_all, topic};
use lgvi_bag::{BagError, BagReader, Qos};
use mcap::{
    WriteOptions,
    records::{MessageHeader, Metadata},
};

/// Topic, log time and sequence of a message.
type Sent = (&'static str, u64, u32);

/// Writes a file with a chunk for every `per_chunk` messages, and metadata records before them.
fn write_file(path: &Path, records: &[(&str, &[(&str, &str)])], per_chunk: usize, sent: &[Sent]) {
    let mut writer = WriteOptions::new()
        .profile("ros2")
        .create(fs::File::create(path).unwrap())
        .unwrap();
    for (name, entries) in records {
        let entries = entries
            .iter()
            .map(|(key, value)| ((*key).to_owned(), (*value).to_owned()));
        let metadata = Metadata {
            name: (*name).to_owned(),
            metadata: entries.collect(),
        };
        writer.write_metadata(&metadata).unwrap();
    }
    let mut channels = BTreeMap::new();
    for (index, &(name, log_time, sequence)) in sent.iter().enumerate() {
        let channel_id = *channels.entry(name).or_insert_with(|| {
            let topic = topic(name, Qos::default());
            let schema = writer
                .add_schema(&topic.type_name, "ros2msg", topic.definition.as_bytes())
                .unwrap();
            writer
                .add_channel(schema, name, "cdr", &BTreeMap::new())
                .unwrap()
        });
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time,
            publish_time: 7,
        };
        writer
            .write_to_known_channel(&header, &payload(sequence))
            .unwrap();
        if index % per_chunk == per_chunk - 1 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
}

const FIRST: &[Sent] = &[
    ("/scene", 10, 0),
    ("/state", 10, 0),
    ("/plan", 11, 0),
    ("/plan", 12, 1),
    ("/state", 20, 1),
];

/// Three repeated messages, and then one that was logged before the file began.
const SECOND: &[Sent] = &[
    ("/scene", 20, 0),
    ("/plan", 20, 0),
    ("/plan", 20, 1),
    ("/plan", 19, 2),
    ("/state", 20, 2),
    ("/state", 30, 3),
];

fn write_bag(directory: &Path, per_chunk: usize, scene: &str, plan: &str) {
    fs::create_dir_all(directory).unwrap();
    write_file(&directory.join("run_0.mcap"), &[], per_chunk, FIRST);
    let repeated: (&str, &[_]) = ("lgvi_repeated", &[("/scene", scene), ("/plan", plan)]);
    let other: (&str, &[_]) = ("other", &[("/state", "5")]);
    write_file(
        &directory.join("run_1.mcap"),
        &[other, repeated, other],
        per_chunk,
        SECOND,
    );
    write_metadata(directory, &["run_0.mcap", "run_1.mcap"], [2, 5, 4]);
}

fn write_metadata(directory: &Path, files: &[&str], [scenes, plans, states]: [u64; 3]) {
    let topics = [("/scene", scenes), ("/plan", plans), ("/state", states)].map(|(name, count)| {
        format!(
            "    - topic_metadata: {{name: {name}, type: std_msgs/msg/String, serialization_format: cdr}}\n      message_count: {count}\n"
        )
    });
    let text = format!(
        "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  duration: {{nanoseconds: 20}}\n  \
         starting_time: {{nanoseconds_since_epoch: 10}}\n  message_count: {}\n  topics_with_message_count:\n{}  \
         relative_file_paths: [{}]\n",
        scenes + plans + states,
        topics.concat(),
        files.join(", ")
    );
    fs::write(directory.join("metadata.yaml"), text).unwrap();
}

fn read(path: &Path) -> Vec<(String, u64, u32)> {
    let messages = read_all(path).unwrap().into_iter();
    messages
        .map(|message| (message.topic, message.log_time, message.sequence))
        .collect()
}

fn counts(path: &Path) -> Vec<u64> {
    let bag = BagReader::open(path).unwrap();
    let counts = bag.message_counts();
    ["/scene", "/plan", "/state"]
        .map(|topic| counts[topic])
        .to_vec()
}

#[test]
fn repeated_messages_are_given_out_once() {
    for per_chunk in [1, 2, 3, 100] {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().join("run");
        write_bag(&directory, per_chunk, "1", "2");
        let expected: Vec<(String, u64, u32)> = [
            ("/scene", 10, 0),
            ("/state", 10, 0),
            ("/plan", 11, 0),
            ("/plan", 12, 1),
            ("/plan", 19, 2),
            ("/state", 20, 1),
            ("/state", 20, 2),
            ("/state", 30, 3),
        ]
        .map(|(topic, time, sequence)| (topic.to_owned(), time, sequence))
        .to_vec();
        assert_eq!(read(&directory), expected, "{per_chunk} a chunk");
        assert_eq!(counts(&directory), [1, 3, 4]);

        // From a time on, at which the repeated ones are logged.
        let bag = BagReader::open(&directory).unwrap();
        let later = bag
            .messages_of(20, |_| true)
            .map(|message| message.unwrap().sequence);
        assert_eq!(later.collect::<Vec<_>>(), [1, 2, 3]);
    }
}

#[test]
fn a_file_alone_has_what_it_repeats() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    write_bag(&directory, 2, "1", "2");
    let second = directory.join("run_1.mcap");
    assert_eq!(read(&second).len(), SECOND.len());
    assert_eq!(counts(&second), [1, 3, 2]);

    // The first of the bag's files, even if it was the second one when it was recorded.
    fs::remove_file(directory.join("run_0.mcap")).unwrap();
    write_metadata(&directory, &["run_1.mcap"], [1, 3, 2]);
    assert_eq!(read(&directory).len(), SECOND.len());
    assert_eq!(counts(&directory), [1, 3, 2]);
}

#[test]
fn counts_of_the_metadata_include_repeats() {
    let folder = tempfile::tempdir().unwrap();
    write_bag(folder.path(), 2, "1", "2");
    write_metadata(folder.path(), &["run_0.mcap", "run_1.mcap"], [1, 3, 4]);
    let error = BagReader::open(folder.path()).map(drop).unwrap_err();
    assert!(
        error.to_string().contains("message_count of /plan is 3"),
        "{error}"
    );
}

#[test]
fn what_is_not_repeated_is_not_skipped() {
    for (scene, plan, damaged) in [
        ("2", "2", true),
        ("1", "4", true),
        ("1", "18446744073709551615", true),
        ("1", "two", true),
        ("1", "-1", true),
        ("0", "0", false),
    ] {
        let folder = tempfile::tempdir().unwrap();
        write_bag(folder.path(), 2, scene, plan);
        let found = BagReader::open(folder.path()).map(drop);
        let refused = matches!(&found, Err(BagError::Damaged { source, .. })
            if source.to_string().starts_with("lgvi_repeated record"));
        assert_eq!(refused, damaged, "{scene} {plan}: {found:?}");
    }
}
