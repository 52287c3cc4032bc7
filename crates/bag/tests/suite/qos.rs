//! Quality of service, as bags hold it.

use std::{collections::BTreeMap, fs, path::Path};

use crate::common::{McapFile, metadata, payload, topic};
use lgvi_bag::{BagOptions, BagReader, BagWriter, History, Qos};
use mcap::{WriteOptions, records::MessageHeader};

/// What rosbag2 of Jazzy writes for a publisher of the default.
const DEFAULT: &str = "\
- history: keep_last
  depth: 10
  reliability: reliable
  durability: volatile
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
";

/// Writes a bag with a topic of this quality; what the file says of it.
fn written(directory: &Path, qos: Qos) -> String {
    let mut writer = BagWriter::create(directory, BagOptions::default()).unwrap();
    let id = writer.add_topic(&topic("/a", qos)).unwrap();
    writer.write(id, 1, 1, 0, &payload(0)).unwrap();
    let summary = writer.finish(BTreeMap::new()).unwrap();
    let file = McapFile::read(&summary.files[0]);
    let channel = file.summary.channels.values().next().unwrap();
    channel.metadata["offered_qos_profiles"].clone()
}

fn all() -> Vec<Qos> {
    let mut all = Vec::new();
    for reliable in [true, false] {
        for durable in [true, false] {
            for history in [History::KeepLast, History::KeepAll, History::Unknown] {
                all.push(Qos {
                    reliable,
                    durable,
                    history,
                    depth: 7,
                });
            }
        }
    }
    all
}

#[test]
fn what_is_written_is_read() {
    for qos in all() {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().join("run");
        let text = written(&directory, qos);
        assert_eq!(BagReader::open(&directory).unwrap().topics()[0].qos, qos);
        // As in `metadata.yaml`, where it is no text.
        let topics = &metadata(&directory)["topics_with_message_count"];
        let profiles = &topics[0]["topic_metadata"]["offered_qos_profiles"];
        let read: serde_yaml_ng::Value = serde_yaml_ng::from_str(&text).unwrap();
        assert_eq!(*profiles, read);
    }
}

#[test]
fn the_text_is_that_of_jazzy() {
    let folder = tempfile::tempdir().unwrap();
    let text = written(&folder.path().join("run"), Qos::default());
    assert_eq!(text, DEFAULT);
    let unknown = Qos {
        history: History::Unknown,
        depth: 0,
        ..Qos::default()
    };
    let text = written(&folder.path().join("other"), unknown);
    assert!(
        text.starts_with("- history: unknown\n  depth: 0\n"),
        "{text}"
    );
}

/// What is read of a file that another recorder wrote.
fn read(text: &str) -> Qos {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    let file = fs::File::create(&path).unwrap();
    let mut writer = WriteOptions::new().profile("ros2").create(file).unwrap();
    let schema = writer.add_schema("a/msg/A", "ros2msg", b"bool a").unwrap();
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), text.to_owned())]);
    let channel_id = writer.add_channel(schema, "/a", "cdr", &metadata).unwrap();
    let header = MessageHeader {
        channel_id,
        sequence: 0,
        log_time: 5,
        publish_time: 5,
    };
    writer.write_to_known_channel(&header, &payload(0)).unwrap();
    writer.finish().unwrap();
    let bag = BagReader::open(&path).unwrap();
    assert!(bag.warnings().is_empty(), "{:?}", bag.warnings());
    bag.topics()[0].qos
}

/// A profile with the names or numbers of policies, in the order history, depth, reliability, durability.
fn profile(policies: [&str; 4]) -> String {
    let [history, depth, reliability, durability] = policies;
    let infinite = "{sec: 9223372036, nsec: 854775807}";
    format!(
        "- {{history: {history}, depth: {depth}, reliability: {reliability}, durability: {durability}, deadline: {infinite}, \
         lifespan: {infinite}, liveliness: 1, liveliness_lease_duration: {infinite}, \
         avoid_ros_namespace_conventions: false}}\n"
    )
}

/// Policies are numbers there.
#[test]
fn what_humble_records_is_read() {
    let expected = Qos {
        reliable: false,
        durable: true,
        history: History::Unknown,
        depth: 0,
    };
    assert_eq!(read(&profile(["3", "0", "2", "1"])), expected);
    let expected = Qos {
        history: History::KeepAll,
        depth: 0,
        ..Qos::default()
    };
    assert_eq!(read(&profile(["2", "0", "1", "2"])), expected);
    assert_eq!(read(""), Qos::default());
    assert_eq!(read("[]"), Qos::default());
}

#[test]
fn late_joiners_are_taken_to_get_what_a_publisher_keeps() {
    let assumed = |history, depth| {
        let qos = Qos {
            history,
            depth,
            ..Qos::default()
        };
        qos.assumed_depth()
    };
    assert_eq!(assumed(History::KeepLast, 0), 1);
    assert_eq!(assumed(History::KeepLast, 7), 7);
    assert_eq!(assumed(History::KeepAll, 0), u32::MAX);
    assert_eq!(assumed(History::Unknown, 0), Qos::default().depth);
}

#[test]
fn publishers_keep_together_what_each_of_them_keeps() {
    use History::{KeepAll, KeepLast, Unknown};
    let most = &u32::MAX.to_string();
    let latched = |history, depth| profile([history, depth, "reliable", "transient_local"]);
    let volatile = profile(["keep_all", "100", "reliable", "volatile"]);
    for (profiles, history, depth) in [
        (vec![latched("keep_last", "1"); 15], KeepLast, 15),
        (
            vec![latched("keep_last", "2"), latched("keep_last", "5")],
            KeepLast,
            7,
        ),
        (
            vec![latched("keep_last", most), latched("keep_last", "5")],
            KeepLast,
            u32::MAX,
        ),
        (vec![volatile, latched("keep_last", "5")], KeepLast, 5),
        (
            vec![latched("keep_last", "5"), latched("unknown", "0")],
            Unknown,
            5,
        ),
        (
            vec![latched("keep_all", "0"), latched("unknown", "0")],
            KeepAll,
            0,
        ),
    ] {
        let together = Qos {
            reliable: true,
            durable: true,
            history,
            depth,
        };
        assert_eq!(read(&profiles.concat()), together);
        let reversed: Vec<_> = profiles.into_iter().rev().collect();
        assert_eq!(read(&reversed.concat()), together);
    }
}

#[test]
fn streams_are_not_latched_whatever_their_publishers_keep() {
    let is_latched = |name: &str, type_name: &str, durable| {
        let mut topic = topic(name, Qos::default());
        topic.type_name = type_name.to_owned();
        topic.qos.durable = durable;
        topic.is_latched()
    };
    assert!(is_latched("/scene", "lgvi_msgs/msg/Scene", true));
    assert!(!is_latched("/scene", "lgvi_msgs/msg/Scene", false));
    assert!(!is_latched("/odometry", "nav_msgs/msg/Odometry", true));
    assert!(!is_latched("/tf", "tf2_msgs/msg/TFMessage", true));
    assert!(is_latched("/a/tf_static", "tf2_msgs/msg/TFMessage", true));
}
