//! What is written is read, in order, whole, and as rosbag2 lays it out.

use std::{collections::BTreeMap, fs, path::Path};

use crate::common::{payload, read_all, topic};
use lgvi_bag::{BagOptions, BagReader, BagWriter, Compression, History, Qos, WriteError};

fn latched() -> Qos {
    Qos {
        reliable: true,
        durable: true,
        history: History::KeepLast,
        depth: 1,
    }
}

fn write_bag(directory: &Path, options: BagOptions, times: impl IntoIterator<Item = u64>) {
    let mut writer = BagWriter::create(directory, options).unwrap();
    let topics = [topic("/a", Qos::default()), topic("/b", latched())];
    let ids = topics
        .each_ref()
        .map(|topic| writer.add_topic(topic).unwrap());
    for (sequence, time) in (0..).zip(times) {
        let id = ids[sequence as usize % ids.len()];
        writer
            .write(id, time, time + 1, sequence, &payload(sequence))
            .unwrap();
    }
    let custom = BTreeMap::from([("scene".to_owned(), "two: lines\n# and a hash".to_owned())]);
    writer.finish(custom).unwrap();
}

#[test]
fn messages_topics_and_custom_data() {
    for compression in [Compression::None, Compression::Zstd] {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().join("run");
        // Several chunks.
        write_bag(
            &directory,
            BagOptions {
                compression,
                ..BagOptions::default()
            },
            (0..20_000).map(|k| 1_000 + k),
        );

        let bag = BagReader::open(&directory).unwrap();
        assert_eq!(
            bag.topics(),
            [topic("/a", Qos::default()), topic("/b", latched())]
        );
        assert_eq!(bag.custom()["scene"], "two: lines\n# and a hash");
        assert_eq!(
            bag.message_counts(),
            BTreeMap::from([("/a", 10_000), ("/b", 10_000)])
        );
        assert_eq!(bag.times(), Some((1_000, 20_999)));
        let mut expected = 0;
        for message in bag.messages() {
            let message = message.unwrap();
            assert_eq!(message.sequence, expected);
            assert_eq!(message.topic.name, ["/a", "/b"][expected as usize % 2]);
            assert_eq!(
                (message.log_time, message.publish_time),
                (1_000 + u64::from(expected), 1_001 + u64::from(expected))
            );
            assert_eq!(message.data, payload(expected));
            expected += 1;
        }
        assert_eq!(expected, 20_000);
    }
}

#[test]
fn log_time_orders_messages_and_the_file_breaks_ties() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    // Falls through whole chunks and holds every time four times.
    let times: Vec<u64> = (0..20_000).map(|k| (19_999 - k) / 4).collect();
    write_bag(&directory, BagOptions::default(), times.iter().copied());

    let mut expected: Vec<(u64, u32)> = times.into_iter().zip(0..).collect();
    expected.sort_by_key(|&(time, _)| time);
    let read: Vec<_> = read_all(&directory)
        .unwrap()
        .into_iter()
        .map(|m| (m.log_time, m.sequence))
        .collect();
    assert_eq!(read, expected);
}

#[test]
fn several_files_are_merged() {
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["run", "other"].map(|name| folder.path().join(name));
    write_bag(&first, BagOptions::default(), [10, 30, 50]);
    write_bag(&second, BagOptions::default(), [20, 30, 40, 60]);
    fs::copy(second.join("other_0.mcap"), first.join("other_0.mcap")).unwrap();
    let metadata = fs::read_to_string(first.join("metadata.yaml")).unwrap();
    let metadata = metadata
        .replace("  - run_0.mcap\n", "  - run_0.mcap\n  - other_0.mcap\n")
        .replace("message_count: 3\n  topics", "message_count: 7\n  topics")
        .replace("message_count: 2", "message_count: 4")
        .replace("message_count: 1", "message_count: 3");
    fs::write(first.join("metadata.yaml"), metadata).unwrap();

    let read: Vec<_> = read_all(&first)
        .unwrap()
        .into_iter()
        .map(|m| (m.log_time, m.sequence))
        .collect();
    assert_eq!(
        read,
        [
            (10, 0),
            (20, 0),
            (30, 1),
            (30, 1),
            (40, 2),
            (50, 2),
            (60, 3)
        ]
    );
    assert_eq!(BagReader::open(&first).unwrap().times(), Some((10, 60)));
}

#[test]
fn metadata_is_that_of_jazzy() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    write_bag(&directory, BagOptions::default(), [7, 5, 9]);
    let text = fs::read_to_string(directory.join("metadata.yaml")).unwrap();
    assert_eq!(text, include_str!("../metadata.yaml"));
}

#[test]
fn summary_tells_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = BagWriter::create(&directory, BagOptions::default()).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    writer.add_topic(&topic("/silent", Qos::default())).unwrap();
    for time in [30, 10, 20] {
        writer.write(id, time, time, 0, &payload(0)).unwrap();
    }
    let path = writer.path();
    let summary = writer.finish(BTreeMap::new()).unwrap();
    assert_eq!(
        summary.messages,
        BTreeMap::from([("/a".to_owned(), 3), ("/silent".to_owned(), 0)])
    );
    assert_eq!(summary.times, Some((10, 30)));
    assert_eq!(summary.bytes, fs::metadata(path).unwrap().len());
    assert!(BagReader::open(&directory).unwrap().custom().is_empty());
}

#[test]
fn a_bag_without_messages_is_a_bag() {
    let folder = tempfile::tempdir().unwrap();
    for (name, topics) in [("none", 0), ("one", 1)] {
        let directory = folder.path().join(name);
        let mut writer = BagWriter::create(&directory, BagOptions::default()).unwrap();
        for _ in 0..topics {
            writer.add_topic(&topic("/a", Qos::default())).unwrap();
        }
        assert_eq!(writer.finish(BTreeMap::new()).unwrap().times, None);
        let bag = BagReader::open(&directory).unwrap();
        assert_eq!(
            (bag.topics().len(), bag.times(), bag.messages().count()),
            (topics, None, 0)
        );
    }
}

/// What a killed process leaves behind is the file as it is on disk after the last flush.
#[test]
fn flushed_messages_are_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = BagWriter::create(&folder.path().join("run"), BagOptions::default()).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    for sequence in 0..10 {
        writer
            .write(id, 0, 0, sequence, &payload(sequence))
            .unwrap();
    }
    writer.flush().unwrap();
    for sequence in 10..20 {
        writer
            .write(id, 0, 0, sequence, &payload(sequence))
            .unwrap();
    }
    let killed = fs::read(writer.path()).unwrap();

    // The linear reader of the mcap crate stands for a recovery tool.
    let sequences: Vec<u32> = mcap::io::MessageReader::new(&*killed)
        .map_while(Result::ok)
        .map(|message| message.sequence)
        .collect();
    assert_eq!(sequences, (0..10).collect::<Vec<_>>());

    let path = folder.path().join("killed.mcap");
    fs::write(&path, &killed).unwrap();
    let error = BagReader::open(&path).map(drop).unwrap_err().to_string();
    assert!(error.contains("truncated: expected"), "{error}");
}

#[test]
fn a_dropped_writer_leaves_a_readable_file() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = BagWriter::create(&directory, BagOptions::default()).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    writer.write(id, 1, 1, 0, &payload(0)).unwrap();
    drop(writer);
    assert!(!directory.join("metadata.yaml").exists());
    assert_eq!(read_all(&directory).unwrap().len(), 1);
}

#[test]
fn topics_are_added_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = BagWriter::create(&folder.path().join("run"), BagOptions::default()).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    assert_eq!(writer.add_topic(&topic("/a", Qos::default())).unwrap(), id);
    let mut other = topic("/a", Qos::default());
    other.type_name = "std_msgs/msg/Header".to_owned();
    assert!(matches!(
        writer.add_topic(&other),
        Err(WriteError::Refused(_))
    ));

    let mut second =
        BagWriter::create(&folder.path().join("second"), BagOptions::default()).unwrap();
    let error = second.write(id, 0, 0, 0, &[]).unwrap_err().to_string();
    assert!(
        error.contains("id 0 is not of this bag, which has 0 topics"),
        "{error}"
    );
}

/// What no reader takes is refused, and the bag goes on.
#[test]
fn a_message_that_is_too_long_does_not_end_the_bag() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = BagWriter::create(&directory, BagOptions::default()).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    let longest = (64 << 20) - 22;
    let mut data = vec![0; longest + 1];
    writer.write(id, 1, 1, 0, &payload(0)).unwrap();
    let error = writer.write(id, 2, 2, 1, &data).unwrap_err();
    let too_long = longest + 1;
    let expected = format!("a message of /a has {too_long} bytes, expected at most {longest}");
    assert_eq!(error.to_string(), expected);
    data.pop();
    writer.write(id, 3, 3, 2, &data).unwrap();
    writer.finish(BTreeMap::new()).unwrap();
    let read = read_all(&directory).unwrap();
    let sequences: Vec<_> = read.iter().map(|message| message.sequence).collect();
    assert_eq!(sequences, [0, 2]);
    assert_eq!(read[1].data.len(), longest);
}

#[test]
fn nothing_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let create = |path: &Path| BagWriter::create(path, BagOptions::default()).map(drop);
    create(&folder.path().join("new/run")).unwrap();
    fs::create_dir(folder.path().join("empty")).unwrap();
    create(&folder.path().join("empty")).unwrap();
    for path in ["new/run", "empty", "new/run/run_0.mcap"] {
        assert!(
            matches!(
                create(&folder.path().join(path)),
                Err(WriteError::Exists(_))
            ),
            "{path}"
        );
    }
    assert!(matches!(create(Path::new("/")), Err(WriteError::NoName(_))));
}
