//! Topics that are no ROS 2 topics, which MCAP allows beside those that are.

use std::{collections::BTreeMap, fs, path::Path};

use crate::common::{payload, read_all, topic};
use lgvi_bag::{BagOptions, BagReader, BagWriter, Qos};
use mcap::{WriteOptions, records::MessageHeader};

/// Messages of `/a`; the other topics have as many.
const MESSAGES: u32 = 100;

const JSON: &str = r#"its messages are "json", expected "cdr""#;
const UNTYPED: &str = "it has no type and no definition";

/// Writes a topic of CDR among one of JSON and one without schema.
fn write_file(path: &Path, options: WriteOptions) {
    let mut writer = options
        .profile("ros2")
        .create(fs::File::create(path).unwrap())
        .unwrap();
    let string = topic("/a", Qos::default());
    let schema = writer
        .add_schema(&string.type_name, "ros2msg", string.definition.as_bytes())
        .unwrap();
    let json = writer.add_schema("Status", "jsonschema", b"{}").unwrap();
    let channels = [
        (json, "/json", "json"),
        (schema, "/a", "cdr"),
        (0, "/untyped", "cdr"),
    ];
    let channels = channels.map(|(schema, topic, encoding)| {
        writer
            .add_channel(schema, topic, encoding, &BTreeMap::new())
            .unwrap()
    });
    for sequence in 0..MESSAGES {
        for channel_id in channels {
            let time = u64::from(sequence);
            let header = MessageHeader {
                channel_id,
                sequence,
                log_time: time,
                publish_time: time,
            };
            let data = payload(sequence);
            writer.write_to_known_channel(&header, &data).unwrap();
        }
    }
    writer.finish().unwrap();
}

fn check(path: &Path) {
    let bag = BagReader::open(path).unwrap();
    let left_out = bag.left_out().iter();
    let left_out: Vec<_> = left_out
        .map(|topic| (&*topic.name, &*topic.type_name, &*topic.reason))
        .collect();
    assert_eq!(
        left_out,
        [("/json", "Status", JSON), ("/untyped", "", UNTYPED)]
    );
    let topics: Vec<_> = bag.topics().iter().map(|topic| &*topic.name).collect();
    assert_eq!(topics, ["/a"]);
    let counts = bag.message_counts();
    assert_eq!(counts, BTreeMap::from([("/a", MESSAGES.into())]));
    assert_eq!(bag.files().next().unwrap().messages, u64::from(MESSAGES));
    let messages = read_all(path).unwrap();
    assert_eq!(messages.len(), MESSAGES as usize);
    for (sequence, message) in (0..).zip(messages) {
        assert_eq!((&*message.topic, message.sequence), ("/a", sequence));
        assert_eq!(message.data, payload(sequence));
    }
}

#[test]
fn topics_of_other_encodings_or_without_schema_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    let options = || WriteOptions::new().chunk_size(Some(5_000));
    for options in [
        options(),
        options().use_chunks(false),
        options()
            .emit_summary_records(false)
            .emit_summary_offsets(false),
        options().emit_statistics(false),
    ] {
        write_file(&path, options);
        check(&path);
    }
}

#[test]
fn messages_of_topics_left_out_do_not_count_against_the_metadata() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("run");
    let mut writer = BagWriter::create(&bag, BagOptions::default()).unwrap();
    for name in ["/a", "/json"] {
        let id = writer.add_topic(&topic(name, Qos::default())).unwrap();
        for sequence in 0..MESSAGES {
            let data = payload(sequence);
            writer.write(id, 0, 0, sequence, &data).unwrap();
        }
    }
    writer.finish(BTreeMap::new()).unwrap();
    let file = bag.join("metadata.yaml");
    let text = fs::read_to_string(&file).unwrap();
    let (before, after) = text.split_once("name: /json").unwrap();
    let after = after.replacen("serialization_format: cdr", "serialization_format: json", 1);
    fs::write(&file, format!("{before}name: /json{after}")).unwrap();
    write_file(&bag.join("run_0.mcap"), WriteOptions::new());
    check(&bag);
}
