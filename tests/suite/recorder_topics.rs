//! Which topics the recorder takes, and how they stand in the bag.

use std::fs;
use std::path::Path;

use lgvi_bag::{BagReader, Topic};
use lgvi_common::Event;
use lgvi_middleware::ros::{Publisher, Qos, RosNode};
use lgvi_msgs::diagnostic_msgs::DiagnosticArray;
use lgvi_msgs::std_msgs::String as Text;
use lgvi_msgs::{RosMessage, cdr};
use lgvi_tests::{Process, World, binary, eventually};

fn say(node: &RosNode, topic: &str, qos: &Qos, text: &str) -> Publisher<Text> {
    let publisher = node.publisher(topic, qos).unwrap();
    let message = Text { data: text.into() };
    publisher.publish(&message).unwrap();
    publisher
}

/// Waits until each of these topics has a message in the bag.
#[track_caller]
fn await_topics(recorder: &Process, topics: &[&str]) {
    eventually(&format!("messages on {topics:?}"), || {
        let stdout = recorder.stdout();
        let events = stdout
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok());
        let mut counts = events.filter_map(|event| match event {
            Event::Recording { messages, .. } => Some(messages),
            _ => None,
        });
        let latest = counts.next_back()?;
        topics
            .iter()
            .all(|topic| latest.contains_key(*topic))
            .then_some(())
    });
}

/// The names of a bag's topics, but for those that all nodes have.
fn names(bag: &Path) -> Vec<String> {
    let bag = BagReader::open(bag).unwrap();
    let mut names: Vec<_> = bag
        .topics()
        .iter()
        .map(|topic| topic.name.clone())
        .collect();
    let common = ["/parameter_events", "/rosout", "/diagnostics"];
    names.retain(|name| !common.contains(&&**name));
    names.sort();
    names
}

#[test]
fn topics_are_chosen_by_name_and_by_what_their_names_contain() {
    let world = World::new();
    let node = world.ros_node("speaker");
    let latched = Qos::latched(1);
    let topics = [
        "/camera/left",
        "/camera/left/raw",
        "/camera/right",
        "/lidar",
        "/odometry",
        "/plan/_action/status",
    ];
    let speakers = topics.map(|topic| say(&node, topic, &latched, topic));
    let record = |bag: &str, parameters: &[&str], expected: &[&str]| {
        let bag = world.path(bag);
        let output = format!("output:={}", bag.display());
        let parameters = [&[&*output, "states:=[]"], parameters].concat();
        let recorder = world.node("recorder", &parameters);
        await_topics(&recorder, expected);
        recorder.stop().expect(0);
        assert_eq!(names(&bag), expected);
    };
    record("all", &[], &topics[..5]);
    record("hidden", &["include_hidden_topics:=true"], &topics);
    let regex = "regex:=^/camera/";
    record("regex", &[regex], &topics[..3]);
    let chosen = [
        regex,
        "topics:=[/odometry, /plan/_action/status, '/lidar=std_msgs/msg/String']",
        "exclude_regex:=raw$",
        "exclude_topics:=['/camera/right', '/lidar']",
    ];
    record("both", &chosen, &[topics[0], topics[4], topics[5]]);
    drop(speakers);
}

#[test]
fn an_expression_that_is_none_is_refused() {
    let world = World::new();
    for (parameter, expected) in [
        ("regex:='('", "regular expression"),
        ("compression:=gzip", "none, lz4, zstd"),
        ("log_time:=now", "received, stamp"),
        ("max_bytes:=-1", "max_bytes"),
        (
            "topics:=['/a=no_msgs/msg/Thing']",
            "share/no_msgs/msg/Thing.msg",
        ),
    ] {
        let recorder = world.node("recorder", &[parameter]);
        recorder.finish().expect(2).says(&[expected]);
    }
}

#[test]
fn topics_stand_in_the_bag_with_what_their_publishers_offer() {
    let world = World::new();
    let node = world.ros_node("speaker");
    let latched = say(&node, "/latched", &Qos::latched(3), "kept");
    let sensor = node.publisher::<Text>("/sensor", &Qos::sensor(3)).unwrap();
    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    let recorder = world.node("recorder", &[&output, "regex:=^/(latched|sensor)$"]);
    await_topics(&recorder, &["/latched"]);
    eventually("a message that nobody sends again", || {
        sensor.publish(&Text { data: "now".into() }).unwrap();
        recorder.stdout().contains("/sensor").then_some(())
    });
    recorder.stop().expect(0);
    drop(latched);

    let text = fs::read_to_string(bag.join("metadata.yaml")).unwrap();
    let metadata: serde_yaml_ng::Value = serde_yaml_ng::from_str(&text).unwrap();
    let topics = &metadata["rosbag2_bagfile_information"]["topics_with_message_count"];
    let mut offered: Vec<Vec<&str>> = topics
        .as_sequence()
        .unwrap()
        .iter()
        .map(|topic| {
            let topic = &topic["topic_metadata"];
            let qos = &topic["offered_qos_profiles"][0];
            assert_eq!(qos["depth"], 0);
            let policies = ["reliability", "durability", "history"];
            let policies = policies.iter().map(|policy| &qos[*policy]);
            let all = std::iter::once(&topic["name"]).chain(policies);
            all.map(|value| value.as_str().unwrap()).collect()
        })
        .collect();
    offered.sort();
    let expected = [
        ["/latched", "reliable", "transient_local", "unknown"],
        ["/sensor", "best_effort", "volatile", "unknown"],
    ];
    assert_eq!(offered, expected);
}

const PAIR: &str = "strange_msgs/msg/Pair";
const HASH: &str = "RIHS01_0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

/// Installs a package with the type [`PAIR`], which is made of another one; returns the text a bag has of it.
fn install(prefix: &Path) -> String {
    let package = |name: &str| {
        let folder = prefix.join(format!("share/{name}/msg"));
        fs::create_dir_all(&folder).unwrap();
        folder
    };
    let strange = package("strange_msgs");
    let (pair, half) = ("other_msgs/Half[2] halves\n", "int32 x # a half\n");
    fs::write(strange.join("Pair.msg"), pair).unwrap();
    let json =
        format!(r#"{{"type_hashes": [{{"type_name": "{PAIR}", "hash_string": "{HASH}"}}]}}"#);
    fs::write(strange.join("Pair.json"), json).unwrap();
    fs::write(package("other_msgs").join("Half.msg"), half).unwrap();
    format!("{pair}\n{}\nMSG: other_msgs/Half\n{half}", "=".repeat(80))
}

#[test]
fn any_type_of_an_installed_package_is_recorded_and_others_are_named_once() {
    let world = World::new();
    let prefix = world.path("prefix");
    let definition = install(&prefix);
    let node = world.ros_node("speaker");
    let latched = Qos::latched(1);
    // Two halves, 100 and 2: no text, which would be 100 bytes long.
    let payload = [0, 1, 0, 0, 100, 0, 0, 0, 2, 0, 0, 0];
    let strange = node.raw_publisher("/strange", PAIR, &latched).unwrap();
    strange.publish(payload.to_vec()).unwrap();
    let nowhere = "nowhere_msgs/msg/Nothing";
    let unknown = node.raw_publisher("/unknown", nowhere, &latched).unwrap();
    unknown.publish(payload.to_vec()).unwrap();

    let bag = world.path("bag");
    let mut command = world.command(&binary("lgvi_recorder"));
    command
        .args(["--supervised", "--ros-args", "-p"])
        .arg(format!("output:={}", bag.display()))
        .env("AMENT_PREFIX_PATH", &prefix);
    let recorder = world.start("recorder", command);
    let warning = "/unknown is not recorded, its type nowhere_msgs/msg/Nothing is not known";
    recorder.await_stderr(warning);
    await_topics(&recorder, &["/strange"]);
    let observer = world.ros_node("observer");
    let diagnostics = observer
        .subscription::<DiagnosticArray>("/diagnostics", &Qos::reliable(10))
        .unwrap();
    let refused = eventually("the recorder's diagnostics", || {
        let message = diagnostics.take().unwrap()?.message;
        let mut parts = message.status.into_iter();
        let part = parts.find(|part| part.name == "lgvi_recorder: recording")?;
        let mut values = part.values.into_iter();
        values.find(|value| value.key == "topics not recorded")
    });
    assert_eq!(refused.value, "1");
    let finished = recorder.stop().expect(0);
    assert_eq!(finished.stderr.matches("/unknown").count(), 1);
    drop((strange, unknown));

    let reader = BagReader::open(&bag).unwrap();
    let found = reader
        .topics()
        .iter()
        .find(|topic| topic.name == "/strange");
    let Topic {
        type_name,
        type_hash,
        definition: text,
        ..
    } = found.unwrap();
    assert_eq!(
        (&**type_name, &**type_hash, text),
        (PAIR, HASH, &definition)
    );
    let messages = reader.messages().map(Result::unwrap);
    let strange: Vec<_> = messages
        .filter(|message| message.topic.name == "/strange")
        .map(|message| message.data)
        .collect();
    assert_eq!(strange, [payload]);
    assert!(
        cdr::decode::<Text>(&payload).is_err(),
        "{}",
        Text::TYPE_NAME
    );
}
