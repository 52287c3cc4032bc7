//! Readers of bags that share no code with ours, PyPI's `rosbags` and `mcap` with `mcap-ros2-support`, read every bag of the
//! repository to its end, and agree with us value by value.

use std::fs;
use std::path::{Path, PathBuf};

use lgvi_bag::{BagOptions, BagReader, Compression};
use lgvi_msgs::msg::{ControlSequence, Intervention, Invariants, PlanProgress, Scene, SystemState};
use lgvi_msgs::nav_msgs::{Odometry, Path as PosePath};
use lgvi_msgs::tf2_msgs::TFMessage;
use lgvi_msgs::visualization_msgs::MarkerArray;
use lgvi_msgs::{RosMessage, cdr};
use lgvi_tests::{Recording, World, earlier_bags, reference_bag, reference_bags};
use serde::Deserialize;
use serde_yaml_ng::Value;

/// A message as `check_bag.py` prints it.
#[derive(Deserialize)]
struct Line {
    topic: String,
    time: u64,
    message: serde_json::Value,
}

/// What `write_variants.py` has written, and how many messages are in it.
#[derive(Deserialize)]
struct Variant {
    path: PathBuf,
    messages: usize,
}

/// JSON as what can hold all numbers: those that it cannot are objects there.
fn value(json: serde_json::Value) -> Value {
    match json {
        serde_json::Value::Object(fields) => {
            match fields.get("float").and_then(|text| text.as_str()) {
                Some(text) => Value::from(text.parse::<f64>().unwrap()),
                None => fields
                    .into_iter()
                    .map(|(name, field)| (Value::from(name), value(field)))
                    .collect::<serde_yaml_ng::Mapping>()
                    .into(),
            }
        }
        serde_json::Value::Array(elements) => {
            Value::Sequence(elements.into_iter().map(value).collect())
        }
        other => serde_yaml_ng::to_value(other).unwrap(),
    }
}

/// What they have read of a message, as our type of it, is the same as what we read, and gives the recorded bytes. Fields that
/// an earlier definition lacks are empty.
#[track_caller]
fn agrees<M: RosMessage + Default + PartialEq>(read: Value, recorded: Recorded<'_>) {
    let Recorded { hash, data, place } = recorded;
    let mut whole = serde_yaml_ng::to_value(M::default()).unwrap();
    let fields = whole.as_mapping_mut().unwrap();
    fields.extend(read.as_mapping().unwrap().clone());
    let theirs: M = serde_yaml_ng::from_value(whole).unwrap();
    let ours: M = cdr::decode_recorded(hash, data).unwrap();
    assert!(theirs == ours, "{place}");
    if hash != M::TYPE_HASH {
        return;
    }
    // DDS fills a payload up to a multiple of four bytes.
    let encoded = cdr::encode(&theirs).unwrap();
    let filling = data.strip_prefix(&*encoded);
    assert!(
        filling.is_some_and(|rest| rest.len() < 4),
        "{place}: other bits"
    );
}

/// A message of a bag.
struct Recorded<'a> {
    hash: &'a str,
    data: &'a [u8],
    place: &'a str,
}

/// Has all of a bag read, and compares.
#[track_caller]
fn compare(world: &World, bag: &Path) {
    let recording = Recording::read(bag);
    let path = bag.to_str().unwrap();
    let summary = world.python("check_bag.py", &[path]).finish().expect(0);
    let summary: serde_json::Value = summary.json();
    assert_eq!(summary["counts"], serde_json::json!(recording.counts()));

    let dump = world.python("check_bag.py", &[path, "--dump"]);
    let dump = dump.finish().expect(0).stdout;
    // Topics interleave otherwise where log times are equal.
    let mut lines: Vec<Line> = dump
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let mut records: Vec<_> = recording.records.iter().collect();
    lines.sort_by(|one, other| one.topic.cmp(&other.topic));
    records.sort_by(|one, other| one.topic.cmp(&other.topic));
    assert_eq!(lines.len(), records.len(), "messages");
    for (line, record) in lines.into_iter().zip(records) {
        let place = format!("{path}: {} at {}", record.topic, record.log_time);
        assert_eq!(
            (&line.topic, line.time),
            (&record.topic, record.log_time),
            "{place}"
        );
        let mut topics = recording.topics.iter();
        let topic = topics.find(|topic| topic.name == record.topic).unwrap();
        let compare = match topic.type_name.as_str() {
            ControlSequence::TYPE_NAME => agrees::<ControlSequence>,
            Intervention::TYPE_NAME => agrees::<Intervention>,
            Invariants::TYPE_NAME => agrees::<Invariants>,
            MarkerArray::TYPE_NAME => agrees::<MarkerArray>,
            Odometry::TYPE_NAME => agrees::<Odometry>,
            PlanProgress::TYPE_NAME => agrees::<PlanProgress>,
            PosePath::TYPE_NAME => agrees::<PosePath>,
            Scene::TYPE_NAME => agrees::<Scene>,
            SystemState::TYPE_NAME => agrees::<SystemState>,
            TFMessage::TYPE_NAME => agrees::<TFMessage>,
            other => panic!("{place}: a message of type {other}"),
        };
        let recorded = Recorded {
            hash: &topic.type_hash,
            data: &record.data,
            place: &place,
        };
        compare(value(line.message), recorded);
    }
}

#[test]
fn they_read_the_reference_bags_as_we_do() {
    let world = World::new();
    for bag in reference_bags() {
        compare(&world, &bag);
    }
}

#[test]
fn they_read_the_bags_of_earlier_versions_as_we_do() {
    let world = World::new();
    for bag in earlier_bags() {
        compare(&world, &bag);
    }
}

#[test]
fn they_read_bags_of_every_compression_as_we_do() {
    let world = World::new();
    let recording = Recording::read(&reference_bag("interventions"));
    for (name, compression) in [
        ("none", Compression::None),
        ("lz4", Compression::Lz4),
        ("zstd", Compression::Zstd),
    ] {
        let bag = world.path(name);
        let options = BagOptions {
            compression,
            ..BagOptions::default()
        };
        recording.write_as(&bag, options);
        compare(&world, &bag);
    }
}

/// A part of a file zeroed, moved, repeated or lost.
fn mutant(bytes: &[u8], chance: &mut fastrand::Rng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let start = chance.usize(..bytes.len());
    let end = bytes.len().min(start + chance.usize(1..2000));
    match chance.u8(..5) {
        0 => bytes[start..end].fill(0),
        1 => bytes[start] ^= 1 << chance.u8(..8),
        2 => bytes.truncate(start),
        3 => drop(bytes.drain(start..end)),
        _ => {
            let copy = bytes[start..end].to_vec();
            bytes.splice(start..start, copy);
        }
    }
    bytes
}

#[test]
fn what_a_check_calls_complete_they_read_to_the_same_messages() {
    let world = World::new();
    let original = reference_bag("interventions").join("interventions_0.mcap");
    let bytes = fs::read(&original).unwrap();
    let mut chance = fastrand::Rng::with_seed(15);
    let mut files = vec![original];
    for number in 0..60 {
        let path = world.path(&format!("mutant_{number}.mcap"));
        fs::write(&path, mutant(&bytes, &mut chance)).unwrap();
        files.push(path);
    }
    let paths: Vec<_> = files.iter().map(|path| path.to_str().unwrap()).collect();
    let read = world.python("read_mutants.py", &paths).finish().expect(0);
    let read: Vec<_> = read.stdout.lines().collect();
    assert_eq!(read.len(), files.len() - 1);
    let lost = read.iter().filter(|found| **found != "same").count();
    assert!(lost > 30, "{lost} of the mutants are damaged");
    for (path, found) in files[1..].iter().zip(read) {
        let is_complete = BagReader::open(path)
            .is_ok_and(|bag| bag.missing().is_empty() && bag.check().is_empty());
        assert!(
            !is_complete || found == "same",
            "{}: {found}",
            path.display()
        );
    }
}

#[test]
fn no_way_of_another_writer_is_called_damaged() {
    let world = World::new();
    let directory = world.path("variants");
    fs::create_dir(&directory).unwrap();
    let arguments = [directory.to_str().unwrap()];
    let written = world.python("write_variants.py", &arguments).finish();
    let written: Vec<Variant> = written.expect(0).json();
    assert!(written.len() > 3000, "{} variants", written.len());
    for Variant { path, messages } in written {
        let bag = BagReader::open(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(bag.missing().is_empty(), "{}", path.display());
        let faults = bag.check();
        assert!(faults.is_empty(), "{faults:?}");
        let read = bag.messages().map(|message| message.unwrap());
        assert_eq!(read.count(), messages, "{}", path.display());
    }
}
