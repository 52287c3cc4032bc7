//! Bags of several files: where they are split, what each file holds by itself, and what is repeated.

use std::{collections::BTreeMap, fs, num::NonZeroU64, path::Path, time::Duration};

use crate::common::{McapFile, Read, latched, metadata, payload, read_all, topic};
use lgvi_bag::{BagOptions, BagSummary, BagWriter, Compression, Qos, Topic, WriteError};
use tempfile::TempDir;

const COMPRESSIONS: [Compression; 3] = [Compression::None, Compression::Lz4, Compression::Zstd];

/// A message of the topic with this index.
fn message(topics: &[Topic], topic: usize, log_time: u64, sequence: u32) -> Read {
    Read {
        topic: topics[topic].name.clone(),
        log_time,
        publish_time: log_time / 2,
        sequence,
        data: payload(sequence),
    }
}

/// A writer that keeps what it has written.
struct Bag {
    folder: TempDir,
    writer: BagWriter,
    written: Vec<Read>,
}

impl Bag {
    fn new(options: BagOptions) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let writer = BagWriter::create(&folder.path().join("run"), options).unwrap();
        Self {
            folder,
            writer,
            written: Vec::new(),
        }
    }

    fn write(&mut self, topic: &Topic, log_time: u64) {
        let sequence = self.written.len() as u32;
        let message = message(std::slice::from_ref(topic), 0, log_time, sequence);
        let id = self.writer.add_topic(topic).unwrap();
        let Read {
            publish_time, data, ..
        } = &message;
        self.writer
            .write(id, log_time, *publish_time, sequence, data)
            .unwrap();
        self.written.push(message);
    }

    fn finish(self) -> (TempDir, Vec<Read>, BagSummary, Vec<McapFile>) {
        let custom = BTreeMap::from([("scene".to_owned(), "dumbbells".to_owned())]);
        let summary = self.writer.finish(custom).unwrap();
        let files: Vec<_> = summary
            .files
            .iter()
            .map(|file| McapFile::read(file))
            .collect();
        check(
            &self.folder.path().join("run"),
            &self.written,
            &summary,
            &files,
        );
        (self.folder, self.written, summary, files)
    }
}

/// What holds for each bag: nothing is lost, nothing is twice but what is marked, and all that describes it agrees.
fn check(directory: &Path, written: &[Read], summary: &BagSummary, files: &[McapFile]) {
    let metadata = metadata(directory);
    assert_eq!(files.last().unwrap().rosbag2(), metadata);
    let names: Vec<_> = (0..files.len()).map(|k| format!("run_{k}.mcap")).collect();
    let listed = metadata["relative_file_paths"].as_sequence().unwrap();
    assert!(listed.iter().eq(&names));
    let paths = names.iter().map(|name| directory.join(name));
    assert!(paths.clone().eq(summary.files.iter().cloned()));
    let sizes = paths.map(|path| fs::metadata(path).unwrap().len());
    assert_eq!(summary.bytes, sizes.sum::<u64>());

    let mut own = Vec::new();
    let mut counts = BTreeMap::<String, u64>::new();
    let mut repeated = 0;
    for (index, file) in files.iter().enumerate() {
        let statistics = file.summary.stats.as_ref().unwrap();
        assert_eq!(statistics.message_count, file.messages.len() as u64);
        assert_eq!(statistics.attachment_count, 0);
        assert_eq!(statistics.metadata_count, file.metadata.len() as u32);
        assert_eq!(
            statistics.chunk_count,
            file.summary.chunk_indexes.len() as u32
        );
        assert_eq!(statistics.channel_count, file.summary.channels.len() as u32);
        assert_eq!(statistics.schema_count, file.summary.schemas.len() as u16);

        let described = &metadata["files"][index];
        assert_eq!(described["path"], names[index].as_str());
        assert_eq!(described["message_count"], file.messages.len() as u64);
        let times = || file.messages.iter().map(|message| message.log_time);
        let start = times().min().unwrap_or(i64::MAX as u64);
        let end = times().max().unwrap_or(i64::MAX as u64);
        assert_eq!(described["starting_time"]["nanoseconds_since_epoch"], start);
        assert_eq!(described["duration"]["nanoseconds"], end - start);
        if !file.messages.is_empty() {
            assert_eq!(
                (statistics.message_start_time, statistics.message_end_time),
                (start, end)
            );
        }
        for message in &file.messages {
            *counts.entry(message.topic.clone()).or_default() += 1;
        }
        let marked = file.repeated().values().sum::<usize>();
        repeated += marked as u64;
        let copy = McapFile {
            messages: file.messages.clone(),
            summary: file.summary.clone(),
            metadata: file.metadata.clone(),
        };
        assert!(index > 0 || marked == 0);
        own.extend(copy.own());
    }
    assert_eq!(own, written);
    own.sort_by_key(|message| message.log_time);
    assert_eq!(read_all(directory).unwrap(), own);
    assert_eq!(summary.repeated, repeated);
    assert_eq!(summary.messages.values().sum::<u64>(), written.len() as u64);
    let times = || written.iter().map(|message| message.log_time);
    assert_eq!(summary.times, times().min().zip(times().max()));
    let total = written.len() as u64 + repeated;
    assert_eq!(metadata["message_count"], total);
    for topic in metadata["topics_with_message_count"].as_sequence().unwrap() {
        let name = topic["topic_metadata"]["name"].as_str().unwrap();
        let count = counts.remove(name).unwrap_or(0);
        assert_eq!(topic["message_count"], count, "{name}");
    }
    assert!(counts.is_empty());
}

#[test]
fn by_size() {
    for compression in COMPRESSIONS {
        let most = 40_000;
        let mut bag = Bag::new(BagOptions {
            compression,
            max_bytes: NonZeroU64::new(most),
            max_duration: None,
        });
        let topics = [topic("/a", Qos::default()), latched("/map", 1)];
        bag.write(&topics[1], 0);
        for k in 0..3_000 {
            bag.write(&topics[0], k);
        }
        let (_folder, _, summary, files) = bag.finish();
        assert!(files.len() > 4, "{compression:?}: {}", files.len());
        for path in &summary.files[..files.len() - 1] {
            let size = fs::metadata(path).unwrap().len();
            // An eighth more, and the index.
            assert!((most..most + most / 8 + 8_000).contains(&size), "{size}");
        }
        for file in &files[1..] {
            assert_eq!(file.repeated(), BTreeMap::from([("/map".to_owned(), 1)]));
        }
    }
}

/// The limit may be less than what every file needs: files then still hold messages.
#[test]
fn by_a_size_that_is_too_small() {
    let mut bag = Bag::new(BagOptions {
        max_bytes: NonZeroU64::new(1),
        ..BagOptions::default()
    });
    let topics = [topic("/a", Qos::default()), latched("/map", 1)];
    for k in 0..500 {
        bag.write(&topics[k as usize % 2], k);
    }
    let (_folder, _, summary, files) = bag.finish();
    assert!((2..200).contains(&files.len()), "{}", files.len());
    // The latched message has no room in half a byte.
    assert_eq!(summary.repeated, 0);
}

#[test]
fn by_duration() {
    let mut bag = Bag::new(BagOptions {
        max_duration: Some(Duration::from_nanos(100)),
        ..BagOptions::default()
    });
    let a = topic("/a", Qos::default());
    // Exactly 100 after the first still belongs to the first file.
    for time in [1_000, 1_100, 1_101, 1_150, 1_201, 1_202, 5_000] {
        bag.write(&a, time);
    }
    let (_folder, _, _, files) = bag.finish();
    let times: Vec<Vec<u64>> = files
        .iter()
        .map(|file| {
            file.messages
                .iter()
                .map(|message| message.log_time)
                .collect()
        })
        .collect();
    assert_eq!(
        times,
        [
            vec![1_000, 1_100],
            vec![1_101, 1_150, 1_201],
            vec![1_202],
            vec![5_000]
        ]
    );
}

/// Two sources with clocks far apart, and a clock that is set back, make neither negative durations nor a file for each
/// message.
#[test]
fn messages_from_before_the_start_of_the_file() {
    let mut bag = Bag::new(BagOptions {
        max_duration: Some(Duration::from_secs(1)),
        ..BagOptions::default()
    });
    let [wall, simulated] = ["/wall", "/simulated"].map(|name| topic(name, Qos::default()));
    let now = 1_700_000_000_000_000_000;
    for k in 0..100 {
        bag.write(&simulated, k);
        bag.write(&wall, now + k);
    }
    bag.write(&simulated, 0);
    let (_folder, _, summary, files) = bag.finish();
    assert_eq!(files.len(), 2);
    assert_eq!(summary.times, Some((0, now + 99)));
}

#[test]
fn latched_messages_are_repeated() {
    let mut bag = Bag::new(BagOptions::default());
    let topics = [
        latched("/two", 2),
        topic("/volatile", Qos::default()),
        latched("/one", 1),
        latched("/none", 3),
    ];
    bag.writer.add_topic(&topics[3]).unwrap();
    for (topic, time) in [(0, 10), (2, 20), (0, 30), (1, 40), (0, 50)] {
        bag.write(&topics[topic], time);
    }
    bag.writer.split().unwrap();
    bag.write(&topics[1], 60);
    bag.write(&topics[2], 70);
    bag.writer.split().unwrap();
    // Comes later into the bag, and its first message is not repeated in its own file.
    let late = latched("/late", 1);
    bag.write(&late, 80);
    bag.writer.split().unwrap();
    let (_folder, written, summary, files) = bag.finish();

    let repeat = |index: usize, log_time| Read {
        log_time,
        ..written[index].clone()
    };
    let heads: Vec<Vec<Read>> = files
        .iter()
        .map(|file| {
            let count = file.repeated().values().sum();
            file.messages[..count].to_vec()
        })
        .collect();
    assert_eq!(heads[0], []);
    // Those of a topic are together, oldest first, at the time of the message that the file begins with.
    assert_eq!(heads[1], [repeat(2, 60), repeat(4, 60), repeat(1, 60)]);
    assert_eq!(heads[2], [repeat(2, 80), repeat(4, 80), repeat(6, 80)]);
    // A last file without a message of its own begins where the bag ends.
    let last = [repeat(2, 80), repeat(4, 80), repeat(6, 80), repeat(7, 80)];
    assert_eq!(heads[3], last);
    assert_eq!(files[3].messages.len(), 4);
    assert_eq!(summary.repeated, 10);
    assert_eq!(
        files[3].repeated(),
        BTreeMap::from([("/two", 2), ("/one", 1), ("/late", 1)].map(|(t, n)| (t.to_owned(), n)))
    );
}

/// They have at most half of what a file may have, whatever their depth.
#[test]
fn repeated_messages_are_bounded() {
    let mut bag = Bag::new(BagOptions {
        compression: Compression::None,
        max_bytes: NonZeroU64::new(20_000),
        max_duration: None,
    });
    let deep = latched("/deep", u32::MAX);
    for k in 0..1_000 {
        bag.write(&deep, k);
    }
    let (_folder, written, _, files) = bag.finish();
    let length = written[0].data.len();
    assert!(files.len() > 5);
    for file in &files[1..] {
        let repeated = file.repeated()["/deep"];
        assert!(
            ((9_000 / length)..=(10_000 / length)).contains(&repeated),
            "{repeated}"
        );
    }
}

/// Each file has all topics known by then, under one type for all of the bag.
#[test]
fn topics_across_splits() {
    let mut bag = Bag::new(BagOptions::default());
    let [a, b] = ["/a", "/b"].map(|name| topic(name, Qos::default()));
    bag.write(&a, 1);
    bag.writer.split().unwrap();
    let mut other = a.clone();
    other.type_name = "std_msgs/msg/Header".to_owned();
    assert!(matches!(
        bag.writer.add_topic(&other),
        Err(WriteError::Refused(_))
    ));
    bag.write(&b, 2);
    bag.writer.split().unwrap();
    bag.write(&b, 3);
    let (_folder, _, summary, files) = bag.finish();
    let topics = |file: &McapFile| {
        let mut names: Vec<_> = file
            .summary
            .channels
            .values()
            .map(|channel| channel.topic.clone())
            .collect();
        names.sort();
        names
    };
    assert_eq!(topics(&files[0]), ["/a"]);
    assert_eq!(topics(&files[1]), ["/a", "/b"]);
    assert_eq!(topics(&files[2]), ["/a", "/b"]);
    // Topics of one type share its definition.
    assert!(files.iter().all(|file| file.summary.schemas.len() == 1));
    assert_eq!(
        summary.messages,
        BTreeMap::from([("/a".to_owned(), 1), ("/b".to_owned(), 2)])
    );
}

#[test]
fn a_file_without_messages_is_not_split() {
    let mut bag = Bag::new(BagOptions::default());
    let a = topic("/a", Qos::default());
    bag.writer.split().unwrap();
    bag.writer.add_topic(&a).unwrap();
    bag.writer.split().unwrap();
    bag.write(&a, 1);
    bag.writer.split().unwrap();
    assert!(bag.writer.path().ends_with("run_1.mcap"));
    bag.writer.split().unwrap();
    assert!(bag.writer.path().ends_with("run_1.mcap"));
    let (_folder, _, _, files) = bag.finish();
    assert_eq!(files.len(), 2);
    assert_eq!(files[1].messages, []);
}

/// Messages longer than a chunk, and empty ones.
#[test]
fn messages_of_any_length() {
    for compression in COMPRESSIONS {
        let folder = tempfile::tempdir().unwrap();
        let options = BagOptions {
            compression,
            ..BagOptions::default()
        };
        let mut writer = BagWriter::create(&folder.path().join("run"), options).unwrap();
        let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
        let lengths = [0, 1, 5 << 20, 0, (1 << 20) - 31, 1 << 20, 7];
        for (sequence, length) in (0..).zip(lengths) {
            let data = vec![sequence as u8; length];
            writer.write(id, 1, 1, sequence, &data).unwrap();
        }
        let summary = writer.finish(BTreeMap::new()).unwrap();
        let file = McapFile::read(&summary.files[0]);
        let read: Vec<_> = file
            .messages
            .iter()
            .map(|message| message.data.len())
            .collect();
        assert_eq!(read, lengths, "{compression:?}");
        for message in &file.messages {
            assert!(
                message
                    .data
                    .iter()
                    .all(|&byte| u32::from(byte) == message.sequence)
            );
        }
    }
}

/// Indexes lead to the messages: a reader that seeks finds what one finds that does not.
#[test]
fn indexes() {
    for compression in COMPRESSIONS {
        let mut bag = Bag::new(BagOptions {
            compression,
            ..BagOptions::default()
        });
        let [a, b] = ["/a", "/b"].map(|name| topic(name, Qos::default()));
        for k in 0..300 {
            bag.write(if k % 3 == 0 { &a } else { &b }, 1_000 - k);
            if k % 100 == 50 {
                bag.writer.flush().unwrap();
            }
        }
        let (_folder, written, summary, files) = bag.finish();
        let bytes = fs::read(&summary.files[0]).unwrap();
        let found = &files[0].summary;
        assert_eq!(found.chunk_indexes.len(), 4);
        let mut read = 0;
        for chunk in &found.chunk_indexes {
            let indexes = found.read_message_indexes(&bytes, chunk).unwrap();
            for (channel, entries) in indexes {
                for entry in entries {
                    let message = found.seek_message(&bytes, chunk, &entry).unwrap();
                    let expected = &written[message.sequence as usize];
                    assert_eq!(message.channel, channel);
                    assert_eq!(
                        (&message.channel.topic, message.log_time, &*message.data),
                        (&expected.topic, expected.log_time, &*expected.data)
                    );
                    read += 1;
                }
            }
        }
        assert_eq!(read, 300);
    }
}
