//! `lgvi info` on bags of lgvi and of others.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use lgvi_bag::{BagOptions, BagWriter, Qos, ROS2MSG, Topic};
use lgvi_msgs::{RosMessage, std_msgs::String as Text};
use lgvi_tests::{Recording, World, root};
use serde_json::Value;

#[track_caller]
fn info(world: &World, bag: &Path, code: i32) -> Value {
    let json = world
        .lgvi(["info".as_ref(), bag.as_os_str(), "--json".as_ref()])
        .finish()
        .expect(code);
    serde_json::from_str(&json.stdout).expect("one JSON object")
}

#[track_caller]
fn text(world: &World, bag: &Path, code: i32) -> String {
    let text = world.lgvi(["info".as_ref(), bag.as_os_str()]);
    text.finish().expect(code).stdout
}

fn topic<'a>(info: &'a Value, name: &str) -> &'a Value {
    let mut topics = info["topics"].as_array().unwrap().iter();
    topics.find(|topic| topic["name"] == name).unwrap()
}

#[test]
fn a_bag_of_lgvi() {
    let world = World::new();
    let bag = root().join("bags/inclination_change");
    let found = info(&world, &bag, 0);
    let recording = Recording::read(&bag);
    assert_eq!(found["complete"], true);
    assert_eq!(found["messages"], recording.records.len());
    assert_eq!(found["start"], recording.records[0].log_time);
    assert_eq!(found["end"], recording.records.last().unwrap().log_time);
    for (name, count) in recording.counts() {
        assert_eq!(topic(&found, name)["messages"], count, "{name}");
    }
    let states = topic(&found, "/lgvi_propagator/state");
    assert_eq!(states["type"], "lgvi_msgs/msg/SystemState");
    let text = text(&world, &bag, 0);
    for fragment in ["/lgvi_propagator/state", "1001", "zstd", "transient local"] {
        assert!(text.contains(fragment), "{fragment} is not in {text}");
    }
}

#[test]
fn what_is_readable_of_a_bag_that_is_cut_off() {
    let world = World::new();
    let bag = world.path("cut");
    fs::create_dir(&bag).unwrap();
    let original = root().join("bags/inclination_change");
    fs::copy(original.join("metadata.yaml"), bag.join("metadata.yaml")).unwrap();
    let whole = fs::read(original.join("inclination_change_0.mcap")).unwrap();
    let file = bag.join("inclination_change_0.mcap");
    fs::write(&file, &whole[..whole.len() - 1000]).unwrap();

    let found = info(&world, &bag, 1);
    assert_eq!(found["complete"], false);
    assert_eq!(topic(&found, "/lgvi_propagator/state")["messages"], 1001);
    let text = text(&world, &bag, 1);
    for fragment in ["not complete", "truncated", "lgvi recover"] {
        assert!(text.contains(fragment), "{fragment} is not in {text}");
    }

    fs::write(&file, "").unwrap();
    let refused = world.lgvi(["info".as_ref(), bag.as_os_str()]).finish();
    refused.expect(2).says(&[file.to_str().unwrap()]);
}

#[test]
fn bags_of_rosbags() {
    let world = World::new();
    let directory = world.path("foreign");
    fs::create_dir(&directory).unwrap();
    let path = directory.to_str().unwrap().to_owned();
    world.python("write_bags.py", &[&path]).finish().expect(0);
    for version in [8, 9] {
        for mode in ["none", "file", "message", "storage"] {
            let bag = directory.join(format!("mcap_{version}_{mode}"));
            let found = info(&world, &bag, 0);
            assert_eq!(found["messages"], 100, "{mode}");
            assert_eq!(found["custom"]["made_by"], "rosbags");
            assert_eq!(topic(&found, "/silent")["messages"], 0);
            assert!((found["duration"].as_f64().unwrap() - 0.99).abs() < 1e-9);

            let messages: Vec<Text> = Recording::read(&bag).messages("/chatter");
            assert_eq!(messages.len(), 100);
            for (number, message) in messages.iter().enumerate() {
                assert_eq!(message.data, format!("message {number}"));
            }
        }
    }
    let sqlite3 = directory.join("sqlite3");
    let refused = world.lgvi(["info".as_ref(), sqlite3.as_os_str()]).finish();
    refused.expect(2).says(&["ros2 bag convert"]);
}

#[test]
fn damage_within_a_bag_is_found_by_a_check() {
    let world = World::new();
    let original = root().join("bags/inclination_change");
    let checked = |bag: &Path, code| {
        let line = ["info".as_ref(), bag.as_os_str(), "--check".as_ref()];
        let text = world.lgvi(line).finish().expect(code).stdout;
        let line = line.into_iter().chain(["--json".as_ref()]);
        let json = world.lgvi(line).finish().expect(code);
        (text, serde_json::from_str::<Value>(&json.stdout).unwrap())
    };
    let (said, found) = checked(&original, 0);
    assert!(said.contains("all of it has been read"), "{said}");
    assert_eq!(
        (&found["complete"], &found["checked"]),
        (&true.into(), &true.into())
    );

    let bag = world.path("damaged");
    fs::create_dir(&bag).unwrap();
    fs::copy(original.join("metadata.yaml"), bag.join("metadata.yaml")).unwrap();
    let name = "inclination_change_0.mcap";
    let mut bytes = fs::read(original.join(name)).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(bag.join(name), bytes).unwrap();
    let summaries = text(&world, &bag, 0);
    assert!(
        summaries.contains("complete by its summaries"),
        "{summaries}"
    );
    assert_eq!(info(&world, &bag, 0)["checked"], false);
    let (said, found) = checked(&bag, 1);
    assert!(said.contains("damaged at byte"), "{said}");
    assert_eq!(found["complete"], false);
    assert_eq!(found["faults"].as_array().unwrap().len(), 1);
}

#[test]
fn topics_that_are_not_of_ros_2_are_left_out_by_name() {
    let world = World::new();
    let file = world.path("mixed.mcap");
    let path = file.to_str().unwrap();
    world.python("mixed_bag.py", &[path]).finish().expect(0);
    let found = info(&world, &file, 0);
    assert_eq!(found["messages"], 10);
    let names: Vec<_> = found["left_out"].as_array().unwrap().iter().collect();
    assert_eq!(names.len(), 2);
    assert_eq!(names[0]["name"], "/status");
    assert_eq!(names[1]["name"], "/untyped");
    let said = text(&world, &file, 0);
    assert!(said.contains("left out: /status (Status)"), "{said}");

    let converted = world.lgvi(["convert", path, "--format", "csv", "--json"]);
    let converted: Value = converted.finish().expect(1).json();
    assert_eq!(converted["files"][0]["rows"], 10);
    assert_eq!(converted["left_out"].as_array().unwrap().len(), 2);

    let play = ["play", path, "--rate", "0"];
    let played = world.lgvi(play).finish().expect(0);
    played.says(&[
        "/status is left out",
        "/untyped is left out",
        "played 10 messages",
    ]);
    let nothing = ["play", path, "--rate", "0", "--topics", "/status"];
    world
        .lgvi(nothing)
        .finish()
        .expect(2)
        .says(&["none of the bag's topics"]);
}

/// A file of one channel with so many messages after another.
fn write_channels(path: &Path, channels: &[(&str, &str, u32)]) {
    let mut writer = mcap::WriteOptions::new()
        .profile("ros2")
        .create(fs::File::create(path).unwrap())
        .unwrap();
    for &(type_name, qos, count) in channels {
        let schema = writer.add_schema(type_name, "ros2msg", b"int8 a").unwrap();
        let metadata = [("offered_qos_profiles".to_owned(), qos.to_owned())];
        let channel_id = writer
            .add_channel(schema, "/a", "cdr", &metadata.into())
            .unwrap();
        for sequence in 0..count {
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence,
                log_time: 1,
                publish_time: 1,
            };
            let data = [0, 1, 0, 0, 7];
            writer.write_to_known_channel(&header, &data).unwrap();
        }
    }
    writer.finish().unwrap();
}

#[test]
fn topics_of_one_name_are_counted_by_type() {
    let world = World::new();
    let file = world.path("two.mcap");
    write_channels(&file, &[("a/msg/A", "", 4), ("a/msg/B", "", 2)]);
    let found = info(&world, &file, 0);
    let counts = found["topics"].as_array().unwrap().iter();
    let counts: Vec<_> = counts.map(|topic| topic["messages"].as_u64()).collect();
    assert_eq!(counts, [Some(4), Some(2)]);
    assert_eq!(found["messages"], 6);
}

#[test]
fn a_quality_of_service_that_cannot_be_read_is_told() {
    let world = World::new();
    let file = world.path("odd.mcap");
    write_channels(&file, &[("a/msg/A", "hello", 1)]);
    let found = info(&world, &file, 0);
    assert_eq!(found["warnings"].as_array().unwrap().len(), 1);
    assert!(text(&world, &file, 0).contains("offered_qos_profiles of /a"));
}

#[test]
fn a_file_that_is_gone_is_missed_without_metadata() {
    let world = World::new();
    let bag = world.path("split");
    fs::create_dir(&bag).unwrap();
    for number in [0, 2] {
        let file = bag.join(format!("split_{number}.mcap"));
        write_channels(&file, &[("a/msg/A", "", 1)]);
    }
    let found = info(&world, &bag, 1);
    assert_eq!(found["complete"], false);
    assert!(text(&world, &bag, 1).contains("split_1.mcap: is not there"));
    let line = ["convert", bag.to_str().unwrap(), "--format", "csv"];
    let converted = world.lgvi(line).finish().expect(1);
    assert!(converted.stdout.contains("split_1.mcap: is not there"));
}

/// A copy of a bag of the repository.
fn copied(world: &World, name: &str) -> PathBuf {
    let original = root().join("bags/inclination_change");
    let bag = world.path(name);
    fs::create_dir(&bag).unwrap();
    for file in ["metadata.yaml", "inclination_change_0.mcap"] {
        fs::copy(original.join(file), bag.join(file)).unwrap();
    }
    bag
}

#[test]
fn metadata_that_the_files_contradict() {
    let world = World::new();
    let edited = |name: &str, from: &str, to: &str| {
        let bag = copied(&world, name);
        let file = bag.join("metadata.yaml");
        let text = fs::read_to_string(&file).unwrap();
        assert!(text.contains(from), "{from} is not in {text}");
        fs::write(&file, text.replacen(from, to, 1)).unwrap();
        bag
    };
    let listed = "- inclination_change_0.mcap\n";
    for (name, from, to, fragment) in [
        (
            "total",
            "  message_count: ",
            "  message_count: 9",
            "message_count is 9",
        ),
        ("twice", listed, &format!("{listed}  {listed}"), "twice"),
    ] {
        let bag = edited(name, from, to);
        let found = info(&world, &bag, 1);
        assert_eq!(found["complete"], false);
        assert_eq!(topic(&found, "/lgvi_propagator/state")["messages"], 1001);
        let text = text(&world, &bag, 1);
        assert!(text.contains(fragment), "{fragment} is not in {text}");
    }
    let bag = copied(&world, "more");
    let file = bag.join("inclination_change_0.mcap");
    fs::copy(&file, bag.join("inclination_change_1.mcap")).unwrap();
    let found = info(&world, &bag, 0);
    let warnings = found["warnings"].as_array().unwrap();
    let warning = warnings[0].as_str().unwrap();
    assert!(
        warning.contains("inclination_change_1.mcap: is not listed"),
        "{warning}"
    );
}

#[test]
fn names_command_no_terminal() {
    let world = World::new();
    let bag = world.path("named");
    let mut writer = BagWriter::create(&bag, BagOptions::default()).unwrap();
    let name = "/a\u{1b}[2J\nb";
    let named = Topic {
        name: name.to_owned(),
        type_name: Text::TYPE_NAME.to_owned(),
        type_hash: Text::TYPE_HASH.to_owned(),
        definition: Text::DEFINITION.to_owned(),
        definition_encoding: ROS2MSG.to_owned(),
        qos: Qos::default(),
    };
    writer.add_topic(&named).unwrap();
    let custom = BTreeMap::from([("note\u{7}".to_owned(), "\u{9b}5m".to_owned())]);
    writer.finish(custom).unwrap();
    let text = text(&world, &bag, 0);
    let control = |letter: char| letter.is_control() && letter != '\n';
    assert!(!text.contains(control), "{text:?}");
    for fragment in ["/a\\u{1b}[2J\\nb  ", "note\\u{7}", "\\u{9b}5m"] {
        assert!(text.contains(fragment), "{fragment} is not in {text}");
    }
    topic(&info(&world, &bag, 0), name);
}
