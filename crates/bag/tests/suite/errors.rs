//! What is no bag, or one that cannot be read, says so.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use crate::common::{payload, read_all, topic};
use lgvi_bag::{BagError, BagOptions, BagReader, BagWriter, Qos};
use mcap::{WriteOptions, records::MessageHeader};
use tempfile::TempDir;

/// A bag of three messages.
fn bag() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = BagWriter::create(&directory, BagOptions::default()).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    for sequence in 0..3 {
        writer
            .write(id, 5, 5, sequence, &payload(sequence))
            .unwrap();
    }
    writer.finish(BTreeMap::new()).unwrap();
    (folder, directory)
}

fn error_of(path: &Path) -> BagError {
    BagReader::open(path).map(drop).expect_err("opened")
}

/// The error after a text in `metadata.yaml` is replaced.
fn error_with(from: &str, to: &str) -> BagError {
    let (_folder, directory) = bag();
    let file = directory.join("metadata.yaml");
    let text = fs::read_to_string(&file).unwrap();
    assert!(text.contains(from), "{from:?} is not in {text}");
    fs::write(&file, text.replace(from, to)).unwrap();
    error_of(&directory)
}

/// The error of an MCAP file with a single channel.
fn error_of_mcap(
    options: WriteOptions,
    schema_encoding: &str,
    encoding: &str,
    qos: &str,
) -> Option<BagError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    let mut writer = options.create(fs::File::create(&path).unwrap()).unwrap();
    let schema = writer
        .add_schema("std_msgs/msg/String", schema_encoding, b"string data")
        .unwrap();
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), qos.to_owned())]);
    let channel = writer
        .add_channel(schema, "/a", encoding, &metadata)
        .unwrap();
    let header = MessageHeader {
        channel_id: channel,
        sequence: 0,
        log_time: 0,
        publish_time: 0,
    };
    writer.write_to_known_channel(&header, &payload(0)).unwrap();
    writer.finish().unwrap();
    read_all(&path).err()
}

#[test]
fn what_is_no_bag() {
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(
        error_of(&folder.path().join("missing")),
        BagError::Io(..)
    ));
    let error = error_of(folder.path()).to_string();
    assert!(
        error.contains("no .mcap file, expected metadata.yaml"),
        "{error}"
    );
    let file = folder.path().join("a.mcap");
    fs::write(&file, "steps = 1000").unwrap();
    let error = error_of(&file);
    assert!(
        error.to_string().ends_with("a.mcap: this is not an MCAP file, expected a bag: a directory with metadata.yaml, or an MCAP file"),
        "{error}"
    );
}

#[test]
fn bags_of_other_storages() {
    let folder = tempfile::tempdir().unwrap();
    for (name, start, storage) in [
        ("run_0.db3", "SQLite format 3\0", "sqlite3"),
        ("run.bag", "#ROSBAG V2.0\n", "ROS 1 bag"),
    ] {
        let file = folder.path().join(name);
        fs::write(&file, start).unwrap();
        let error = error_of(&file);
        assert!(matches!(&error, BagError::Storage { found, .. } if found == storage));
        let convert = if storage == "sqlite3" {
            "ros2 bag convert"
        } else {
            "rosbags-convert"
        };
        assert!(error.to_string().contains(convert), "{error}");
        fs::remove_file(&file).unwrap();
    }
}

#[test]
fn a_bag_without_metadata_is_its_single_file() {
    let (_folder, directory) = bag();
    fs::remove_file(directory.join("metadata.yaml")).unwrap();
    assert_eq!(read_all(&directory).unwrap().len(), 3);
}

#[test]
fn metadata_that_cannot_be_read() {
    let error = error_with("storage_identifier: mcap", "storage_identifier: sqlite3");
    assert!(matches!(&error, BagError::Storage { found, .. } if found == "sqlite3"));
    assert!(error.to_string().contains("ros2 bag convert"), "{error}");

    let error = error_with("version: 9", "version: 10").to_string();
    assert!(
        error.ends_with("version is 10, expected at most 9"),
        "{error}"
    );
    let error = error_with(
        "compression_format: ''\n  compression_mode: ''",
        "compression_format: lz4\n  compression_mode: MESSAGE",
    );
    assert!(
        matches!(&error, BagError::Compressed { mode, format, .. } if mode == "MESSAGE" && format == "lz4"),
        "{error}"
    );
    let error = error_with("message_count: 3", "message_count: three");
    assert!(
        error
            .to_string()
            .contains("message_count: invalid type: string \"three\""),
        "{error}"
    );
    let error = error_with("version: 9", "{");
    assert!(matches!(error, BagError::Invalid(..)), "{error}");
}

#[test]
fn files_outside_of_the_bag() {
    for listed in ["/run_0.mcap", "../run/run_0.mcap"] {
        let error = error_with("  - run_0.mcap", &format!("  - {listed}"));
        let expected = format!("{listed}, expected a path within the bag's directory");
        assert!(error.to_string().contains(&expected), "{error}");
    }
}

#[test]
fn counts_that_do_not_match() {
    for (from, to, told) in [
        (
            "message_count: 3",
            "message_count: 4",
            "of /a is 4, but the bag's files hold 3",
        ),
        (
            "name: /a",
            "name: /b",
            "of /b is 3, but the bag's files hold 0",
        ),
    ] {
        let error = error_with(from, to).to_string();
        assert!(error.ends_with(&format!("message_count {told}")), "{error}");
    }
}

#[test]
fn the_type_hash_is_taken_from_metadata_if_the_file_has_none() {
    let (_folder, directory) = bag();
    let file = directory.join("run_0.mcap");
    let mut writer = WriteOptions::new()
        .profile("ros2")
        .create(fs::File::create(&file).unwrap())
        .unwrap();
    let schema = writer
        .add_schema("std_msgs/msg/String", "ros2msg", b"string data")
        .unwrap();
    let channel_id = writer
        .add_channel(schema, "/a", "cdr", &BTreeMap::new())
        .unwrap();
    for sequence in 0..3 {
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time: 0,
            publish_time: 0,
        };
        writer.write_to_known_channel(&header, &payload(0)).unwrap();
    }
    writer.finish().unwrap();
    let bag = BagReader::open(&directory).unwrap();
    assert_eq!(
        bag.topics()[0].type_hash,
        topic("/a", Qos::default()).type_hash
    );
}

#[test]
fn a_file_that_is_listed_but_missing() {
    let (_folder, directory) = bag();
    let file = directory.join("run_0.mcap");
    fs::remove_file(&file).unwrap();
    assert!(matches!(error_of(&directory), BagError::Io(path, _) if path == file));
}

#[test]
fn mcap_files_that_are_not_of_ros_2() {
    let error = error_of_mcap(WriteOptions::new().profile("ros1"), "ros1msg", "ros1", "");
    let error = error.unwrap().to_string();
    assert!(error.contains("profile is ros1, expected ros2"), "{error}");

    let ros2 = || WriteOptions::new().profile("ros2");
    assert!(error_of_mcap(ros2(), "ros2msg", "cdr", "[]").is_none());
}

#[test]
fn a_total_that_is_not_that_of_the_files() {
    let total = "nanoseconds_since_epoch: 5\n  message_count: ";
    let error = error_with(&format!("{total}3"), &format!("{total}99"));
    let expected = "message_count is 99, but the bag's files hold 3";
    assert!(error.to_string().ends_with(expected), "{error}");
}

#[test]
fn a_file_that_is_listed_twice() {
    let (_folder, directory) = bag();
    let metadata = directory.join("metadata.yaml");
    let text = fs::read_to_string(&metadata).unwrap();
    let (once, twice) = ("  - run_0.mcap\n", "  - run_0.mcap\n  - ./run_0.mcap\n");
    fs::write(&metadata, text.replacen(once, twice, 1)).unwrap();
    let error = error_of(&directory);
    let expected = "./run_0.mcap, expected each file once";
    assert!(error.to_string().ends_with(expected), "{error}");
    let (bag, faults) = BagReader::open_damaged(&directory).unwrap();
    assert_eq!((faults.len(), bag.messages().count()), (1, 3));
}

#[test]
fn a_file_that_is_not_listed_is_odd() {
    let (_folder, directory) = bag();
    let odd = |directory: &Path| {
        let bag = BagReader::open(directory).unwrap();
        bag.warnings()
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
    };
    assert!(odd(&directory).is_empty());
    let other = directory.join("run_1.mcap");
    fs::copy(directory.join("run_0.mcap"), &other).unwrap();
    let warnings = odd(&directory);
    let named = warnings
        .iter()
        .filter(|warning| warning.contains(other.to_str().unwrap()));
    assert_eq!((warnings.len(), named.count()), (1, 1), "{warnings:?}");
}

/// A bag without messages ends before it begins, as some recorders write it.
#[test]
fn a_negative_duration() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = BagWriter::create(&directory, BagOptions::default()).unwrap();
    writer.add_topic(&topic("/a", Qos::default())).unwrap();
    writer.finish(BTreeMap::new()).unwrap();
    let metadata = directory.join("metadata.yaml");
    let text = fs::read_to_string(&metadata).unwrap();
    for (duration, readable) in [("-9223372036854775807", true), ("1.5", false), ("x", false)] {
        let changed = text.replace("nanoseconds: 0\n", &format!("nanoseconds: {duration}\n"));
        assert_ne!(changed, text);
        fs::write(&metadata, changed).unwrap();
        let opened = BagReader::open(&directory).map(|bag| bag.times());
        assert_eq!(opened.is_ok(), readable, "{duration}");
        assert_eq!(opened.ok().flatten(), None);
    }
}
