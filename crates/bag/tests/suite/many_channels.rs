//! Reading, writing and recovering a bag takes time in proportion to the number of its topics, not to its square, with which
//! this test would not end within its time limit.

use std::{collections::BTreeMap, fs, io::BufWriter, path::Path};

use lgvi_bag::{BagOptions, BagReader, BagWriter, Qos, recover};
use mcap::{WriteOptions, records::MessageHeader};

use crate::common::{payload, topic};

/// Half of what the ids of MCAP allow.
const CHANNELS: u16 = 32_000;

#[test]
fn a_bag_of_many_channels_is_read_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag");
    let bag = is_read(&path, WriteOptions::new());

    let mut copy = BagWriter::create(&folder.path().join("copy"), BagOptions::default()).unwrap();
    for topic in bag.topics() {
        copy.add_topic(topic).unwrap();
    }
    copy.finish(BTreeMap::new()).unwrap();

    let recovered = recover(&path, &folder.path().join("recovered")).unwrap();
    assert_eq!(recovered.messages.len(), usize::from(CHANNELS));
}

#[test]
fn one_without_chunks_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let options = WriteOptions::new().use_chunks(false);
    is_read(&folder.path().join("bag"), options);
}

fn is_read(path: &Path, options: WriteOptions) -> BagReader {
    fs::create_dir(path).unwrap();
    let file = path.join("bag_0.mcap");
    let mut writer = options
        .profile("ros2")
        .compression(None)
        .create(BufWriter::new(fs::File::create(&file).unwrap()))
        .unwrap();
    let string = topic("", Qos::default());
    let schema = writer
        .add_schema(&string.type_name, "ros2msg", string.definition.as_bytes())
        .unwrap();
    for index in 0..CHANNELS {
        let name = format!("/topic_{index}");
        let channel_id = writer
            .add_channel(schema, &name, "cdr", &BTreeMap::new())
            .unwrap();
        let header = MessageHeader {
            channel_id,
            sequence: 0,
            log_time: index.into(),
            publish_time: 0,
        };
        writer.write_to_known_channel(&header, &payload(0)).unwrap();
    }
    writer.finish().unwrap();

    let bag = BagReader::open(path).unwrap();
    let faults = bag.check();
    assert!(faults.is_empty(), "{faults:?}");
    let counts = bag.message_counts();
    assert_eq!(counts.len(), usize::from(CHANNELS));
    assert!(counts.values().all(|count| *count == 1));
    for (index, message) in bag.messages().enumerate() {
        let message = message.unwrap();
        assert_eq!(message.topic.name, format!("/topic_{index}"));
        assert_eq!(bag.topics()[message.topic_index], *message.topic);
    }
    bag
}
