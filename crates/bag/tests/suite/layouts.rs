//! Bags as others make them.

use std::{borrow::Cow, collections::BTreeMap, fs, path::Path};

use crate::common::{Read, payload, random, read_all, topic};
use lgvi_bag::{BagError, BagReader, Qos};
use mcap::{
    Attachment, Compression, WriteOptions,
    records::{MessageHeader, Metadata},
};

const MESSAGES: u32 = 3000;

fn log_time(sequence: u32, ascending: bool) -> u64 {
    if ascending {
        u64::from(sequence)
    } else {
        random(sequence.into()) % 1000
    }
}

/// Writes messages of two channels of one topic, with an attachment and metadata among them.
fn write_file(path: &Path, options: WriteOptions, ascending: bool, pack: fn(Vec<u8>) -> Vec<u8>) {
    let mut writer = options
        .profile("ros2")
        .create(fs::File::create(path).unwrap())
        .unwrap();
    let topic = topic("/a", Qos::default());
    let schema = writer
        .add_schema(&topic.type_name, "ros2msg", topic.definition.as_bytes())
        .unwrap();
    let channels = ["", "1"].map(|other| {
        let metadata = BTreeMap::from([("other".to_owned(), other.to_owned())]);
        writer.add_channel(schema, "/a", "cdr", &metadata).unwrap()
    });
    for sequence in 0..MESSAGES {
        let log_time = log_time(sequence, ascending);
        let header = MessageHeader {
            channel_id: channels[sequence as usize % 2],
            sequence,
            log_time,
            publish_time: 1,
        };
        writer
            .write_to_known_channel(&header, &pack(payload(sequence)))
            .unwrap();
        if sequence == 1500 {
            let attachment = Attachment {
                log_time: 0,
                create_time: 0,
                name: "calibration".to_owned(),
                media_type: "text/plain".to_owned(),
                data: Cow::Owned(vec![7; 100_000]),
            };
            writer.attach(&attachment).unwrap();
            let metadata = Metadata {
                name: "foreign".to_owned(),
                metadata: BTreeMap::new(),
            };
            writer.write_metadata(&metadata).unwrap();
        }
    }
    writer.finish().unwrap();
}

fn expected(ascending: bool) -> Vec<Read> {
    let mut expected: Vec<_> = (0..MESSAGES)
        .map(|sequence| Read {
            topic: "/a".to_owned(),
            log_time: log_time(sequence, ascending),
            publish_time: 1,
            sequence,
            data: payload(sequence),
        })
        .collect();
    expected.sort_by_key(|message| message.log_time);
    expected
}

#[test]
fn every_layout_gives_the_same_messages() {
    let options = || WriteOptions::new().chunk_size(Some(20_000));
    let layouts: Vec<(&str, WriteOptions, Option<&str>)> = vec![
        ("zstd", options(), Some("zstd")),
        ("none", options().compression(None), Some("")),
        (
            "lz4",
            options().compression(Some(Compression::Lz4)),
            Some("lz4"),
        ),
        ("without chunks", options().use_chunks(false), None),
        (
            "without chunks and summary",
            options()
                .use_chunks(false)
                .emit_summary_records(false)
                .emit_summary_offsets(false),
            None,
        ),
        (
            "without summary",
            options()
                .emit_summary_records(false)
                .emit_summary_offsets(false),
            Some("zstd"),
        ),
        (
            "without chunk indexes",
            options().emit_chunk_indexes(false),
            Some("zstd"),
        ),
        (
            "without message indexes",
            options().emit_message_indexes(false),
            Some("zstd"),
        ),
        (
            "without statistics",
            options().emit_statistics(false),
            Some("zstd"),
        ),
        (
            "without channels in the summary",
            options().repeat_channels(false).repeat_schemas(false),
            Some("zstd"),
        ),
        (
            "without checksums",
            options()
                .calculate_chunk_crcs(false)
                .calculate_data_section_crc(false)
                .calculate_summary_section_crc(false),
            Some("zstd"),
        ),
    ];
    let folder = tempfile::tempdir().unwrap();
    for (name, options, compression) in layouts {
        for ascending in [true, false] {
            let path = folder.path().join("file.mcap");
            write_file(&path, options.clone(), ascending, |data| data);
            assert!(read_all(&path).unwrap() == expected(ascending), "{name}");

            let bag = BagReader::open(&path).unwrap();
            assert_eq!(bag.topics().len(), 1, "{name}");
            if name != "without statistics" {
                let counts = bag.message_counts();
                assert_eq!(counts, BTreeMap::from([("/a", MESSAGES.into())]), "{name}");
            }
            let last = expected(ascending).last().unwrap().log_time;
            assert_eq!(
                bag.times(),
                Some((expected(ascending)[0].log_time, last)),
                "{name}"
            );
            let file = bag.files().next().unwrap();
            assert_eq!(
                file.chunks.keys().next().map(String::as_str),
                compression,
                "{name}"
            );
            if let Some(chunks) = compression.and_then(|found| file.chunks.get(found)) {
                assert!(chunks.count > 10, "{name}: {chunks:?}");
                assert!(
                    chunks.unpacked > u64::from(MESSAGES) * 100,
                    "{name}: {chunks:?}"
                );
            }

            let from = bag.messages_of(600, |_| true).map(Result::unwrap);
            let later = expected(ascending)
                .into_iter()
                .filter(|message| message.log_time >= 600);
            assert!(
                from.map(|m| m.sequence).eq(later.map(|m| m.sequence)),
                "{name}"
            );
            assert_eq!(
                bag.messages_of(0, |topic| topic.name == "/b").count(),
                0,
                "{name}"
            );
        }
    }
}

#[test]
fn what_rosbag2_compresses_itself() {
    let zstd = |data: Vec<u8>| zstd::encode_all(&*data, 1).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("message.mcap");
    write_file(&path, WriteOptions::new(), true, zstd);
    assert!(read_all(&path).unwrap() == expected(true));

    let plain = folder.path().join("plain.mcap");
    write_file(&plain, WriteOptions::new(), true, |data| data);
    let path = folder.path().join("file.mcap.zstd");
    fs::write(&path, zstd(fs::read(&plain).unwrap())).unwrap();
    assert!(read_all(&path).unwrap() == expected(true));
    // Two at a time read one temporary file.
    let bag = BagReader::open(&path).unwrap();
    let pairs = bag.messages().zip(bag.messages());
    assert!(
        pairs
            .map(|(a, b)| (a.unwrap(), b.unwrap()))
            .all(|(a, b)| a == b)
    );

    let cut = fs::read(&path).unwrap();
    fs::write(&path, &cut[..cut.len() / 2]).unwrap();
    assert!(matches!(read_all(&path), Err(BagError::Io(found, _)) if found == path));
}

#[test]
fn files_without_metadata_are_in_their_natural_order() {
    let folder = tempfile::tempdir().unwrap();
    for (name, sequence) in [("run_10", 2), ("run_9", 1), ("run_0", 0)] {
        one_message(
            &folder.path().join(format!("{name}.mcap")),
            sequence,
            "",
            "ros2msg",
        );
    }
    fs::write(folder.path().join("notes.txt"), "").unwrap();
    let sequences = read_all(folder.path())
        .unwrap()
        .into_iter()
        .map(|m| m.sequence);
    assert_eq!(sequences.collect::<Vec<_>>(), [0, 1, 2]);
}

/// A file with one message at 5 ns.
fn one_message(path: &Path, sequence: u32, qos: &str, encoding: &str) {
    let mut writer = WriteOptions::new()
        .profile("ros2")
        .create(fs::File::create(path).unwrap())
        .unwrap();
    let schema = writer
        .add_schema("a/msg/A", encoding, b"\xff definition")
        .unwrap();
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), qos.to_owned())]);
    let channel_id = writer.add_channel(schema, "/a", "cdr", &metadata).unwrap();
    let header = MessageHeader {
        channel_id,
        sequence,
        log_time: 5,
        publish_time: 5,
    };
    writer
        .write_to_known_channel(&header, &payload(sequence))
        .unwrap();
    writer.finish().unwrap();
}

#[test]
fn definitions_in_other_languages_are_opaque() {
    let folder = tempfile::tempdir().unwrap();
    for encoding in ["ros2idl", "unknown", ""] {
        let path = folder.path().join("file.mcap");
        one_message(&path, 0, "", encoding);
        let bag = BagReader::open(&path).unwrap();
        assert_eq!(bag.topics()[0].definition_encoding, encoding);
        assert_eq!(bag.topics()[0].definition, "\u{fffd} definition");
        assert_eq!(bag.messages().count(), 1);
    }
}

#[test]
fn publishers_of_one_topic_have_the_strongest_quality_of_service_together() {
    let infinite = "{sec: 9223372036, nsec: 854775807}";
    let profile = |reliability: &str, durability: &str, depth: u32| {
        format!(
            "- {{history: keep_last, depth: {depth}, reliability: {reliability}, durability: {durability}, deadline: {infinite}, \
             lifespan: {infinite}, liveliness: automatic, liveliness_lease_duration: {infinite}, \
             avoid_ros_namespace_conventions: false}}\n"
        )
    };
    let reliable = profile("reliable", "volatile", 3);
    let latched = profile("best_effort", "transient_local", 7);
    let folder = tempfile::tempdir().unwrap();
    let strongest = |path: &Path| {
        let bag = BagReader::open(path).unwrap();
        let Qos {
            reliable,
            durable,
            depth,
            ..
        } = bag.topics()[0].qos;
        assert_eq!((reliable, durable, depth), (true, true, 7));
    };
    let both = folder.path().join("0.mcap");
    one_message(&both, 0, &(reliable.clone() + &latched), "ros2msg");
    strongest(&both);
    one_message(&both, 0, &reliable, "ros2msg");
    one_message(&folder.path().join("1.mcap"), 1, &latched, "ros2msg");
    strongest(folder.path());
}

#[test]
fn a_quality_of_service_that_cannot_be_read_is_the_default() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    for odd in [
        "hello",
        "- {history: keep_last}",
        "- {history: keep_last, depth: -1}",
        "- {history: keep_last, depth: 9223372036854775808}",
        "history: keep_last",
    ] {
        one_message(&path, 0, odd, "ros2msg");
        let bag = BagReader::open(&path).unwrap();
        assert_eq!(bag.topics()[0].qos, Qos::default());
        assert_eq!(bag.messages().count(), 1);
        let [warning] = bag.warnings() else {
            panic!("{odd}: {:?}", bag.warnings());
        };
        let text = warning.to_string();
        assert!(
            text.contains("offered_qos_profiles of /a: "),
            "{odd}: {text}"
        );
    }
    one_message(&path, 0, "[]", "ros2msg");
    assert_eq!(BagReader::open(&path).unwrap().warnings().len(), 0);
}

#[test]
fn topics_of_one_name_and_several_types_are_counted_apart() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    for summary in [true, false] {
        let mut writer = WriteOptions::new()
            .emit_statistics(summary)
            .profile("ros2")
            .create(fs::File::create(&path).unwrap())
            .unwrap();
        for (type_name, count) in [("a/msg/A", 4), ("a/msg/B", 2)] {
            let schema = writer.add_schema(type_name, "ros2msg", b"").unwrap();
            let channel_id = writer
                .add_channel(schema, "/a", "cdr", &BTreeMap::new())
                .unwrap();
            for sequence in 0..count {
                let header = MessageHeader {
                    channel_id,
                    sequence,
                    log_time: 1,
                    publish_time: 1,
                };
                writer.write_to_known_channel(&header, &payload(0)).unwrap();
            }
        }
        writer.finish().unwrap();
        let bag = BagReader::open(&path).unwrap();
        assert_eq!(bag.topic_counts(), [4, 2]);
        assert_eq!(bag.message_counts(), BTreeMap::from([("/a", 6)]));
    }
}

/// A file of chunks, each of which unpacks to so many bytes.
fn hostile(path: &Path, chunks: u64, bytes: usize) {
    let mut writer = WriteOptions::new()
        .profile("ros2")
        .calculate_chunk_crcs(false)
        .chunk_size(None)
        .create(fs::File::create(path).unwrap())
        .unwrap();
    let schema = writer.add_schema("a/msg/A", "ros2msg", b"").unwrap();
    let channel_id = writer
        .add_channel(schema, "/a", "cdr", &BTreeMap::new())
        .unwrap();
    let zeros = vec![0; 8 << 20];
    for _ in 0..chunks {
        let mut left = bytes;
        // All overlap: from 0 ns to 1 ns.
        for log_time in [0, 1] {
            let header = MessageHeader {
                channel_id,
                sequence: 0,
                log_time,
                publish_time: 0,
            };
            writer.write_to_known_channel(&header, &[]).unwrap();
        }
        while left > 0 {
            let length = left.min(zeros.len());
            left -= length;
            let header = MessageHeader {
                channel_id,
                sequence: 0,
                log_time: 1,
                publish_time: 0,
            };
            writer
                .write_to_known_channel(&header, &zeros[..length])
                .unwrap();
        }
        writer.flush().unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn memory_is_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    // 800 MiB at once, in a file of some KiB.
    hostile(&path, 100, 8 << 20);
    assert!(fs::metadata(&path).unwrap().len() < 1 << 20);
    let error = read_all(&path).unwrap_err();
    let expected = format!("more than {} bytes; sort the file: mcap sort", 512 << 20);
    assert!(error.to_string().ends_with(&expected), "{error}");

    hostile(&path, 1, 300 << 20);
    let error = read_all(&path).unwrap_err();
    let expected = format!("bytes, expected at most {}", 256 << 20);
    assert!(error.to_string().ends_with(&expected), "{error}");
}

#[test]
fn what_is_readable_of_a_damaged_bag() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    for chunked in [true, false] {
        let options = WriteOptions::new()
            .chunk_size(Some(20_000))
            .use_chunks(chunked);
        write_file(&path, options, true, |data| data);
        let whole = fs::read(&path).unwrap();
        let mut most = 0;
        for length in (0..whole.len()).step_by(whole.len() / 50) {
            fs::write(&path, &whole[..length]).unwrap();
            let error = read_all(&path).unwrap_err().to_string();
            assert!(error.contains("truncated: expected"), "{error}");
            let Ok((bag, faults)) = BagReader::open_damaged(&path) else {
                assert!(length < 100, "nothing of {length} bytes");
                continue;
            };
            assert!(faults.is_empty());
            let file = bag.files().next().unwrap();
            let fault = file.fault;
            assert!(matches!(fault, Some(BagError::Damaged { .. })), "{fault:?}");
            let sequences: Vec<_> = bag.messages().map(|m| m.unwrap().sequence).collect();
            let count = sequences.len() as u32;
            assert!(sequences.into_iter().eq(0..count));
            assert_eq!(file.messages, u64::from(count));
            assert!(count >= most, "{count} of {length} bytes");
            most = count;
        }
        assert!(most > MESSAGES * 9 / 10, "{most}");
    }
}
