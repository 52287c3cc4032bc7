//! Reading all of a bag finds what its files do not tell at their ends.

use std::{collections::BTreeMap, fs, path::Path};

use crate::common::{payload, topic};
use lgvi_bag::{BagError, BagReader, Qos};
use mcap::{WriteOptions, records::MessageHeader};

const MESSAGES: u32 = 100;

/// Offset of the first channel's count in a statistics record: after the total, six numbers of other things and two times,
/// the length of the counts and the channel's id.
const FIRST_COUNT: usize = 8 + 2 + 4 * 4 + 2 * 8 + 4 + 2;

const STATISTICS: u8 = 0x0b;

/// A file of several chunks, whose summary has no checksum.
fn file() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    let mut writer = WriteOptions::new()
        .profile("ros2")
        .compression(None)
        .chunk_size(Some(2_000))
        .calculate_summary_section_crc(false)
        .create(fs::File::create(&path).unwrap())
        .unwrap();
    let string = topic("/a", Qos::default());
    let schema = writer
        .add_schema(&string.type_name, "ros2msg", string.definition.as_bytes())
        .unwrap();
    let channel_id = writer
        .add_channel(schema, "/a", "cdr", &BTreeMap::new())
        .unwrap();
    for sequence in 0..MESSAGES {
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time: sequence.into(),
            publish_time: 0,
        };
        let data = payload(sequence);
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
    fs::read(path).unwrap()
}

/// What is wrong with a file that can be opened.
fn faults(path: &Path, bytes: &[u8]) -> Vec<String> {
    fs::write(path, bytes).unwrap();
    let bag = BagReader::open(path).unwrap();
    let damage = |error| match error {
        BagError::Damaged { source, .. } => source.to_string(),
        other => panic!("{other}"),
    };
    bag.check().into_iter().map(damage).collect()
}

/// The only damage is what the statistics tell of a field.
#[track_caller]
fn disagrees(faults: &[String], expected: &str, of_statistics: &str, of_records: &str) {
    let expected = format!("statistics record: {expected}: {of_statistics}, found {of_records}");
    assert_eq!(faults, [expected]);
}

fn position(bytes: &[u8], wanted: &[u8]) -> usize {
    let mut windows = bytes.windows(wanted.len());
    windows.position(|window| window == wanted).unwrap()
}

#[test]
fn a_damaged_chunk_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    let whole = file();
    assert_eq!(faults(&path, &whole).len(), 0);
    for sequence in [0, MESSAGES / 2, MESSAGES - 1] {
        let mut bytes = whole.clone();
        let at = position(&bytes, &payload(sequence));
        bytes[at + 20] ^= 1;
        let faults = faults(&path, &bytes);
        assert!(faults[0].starts_with("checksum of the chunk"), "{faults:?}");
        assert_eq!(faults.len(), 1);
    }
}

#[test]
fn a_count_that_is_not_that_of_the_chunks_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    let mut bytes = file();
    // Its total is the first number of the record.
    let start = [&[STATISTICS], &56_u64.to_le_bytes()[..], &[100, 0, 0, 0]].concat();
    let at = position(&bytes, &start) + 9 + FIRST_COUNT;
    assert_eq!(bytes[at], 100);
    bytes[at] = 101;
    let faults = faults(&path, &bytes);
    disagrees(&faults, "messages by channel", "{1: 101}", "{1: 100}");
}

/// Offsets of first and last log time in a statistics record.
const TIMES: [usize; 2] = [8 + 2 + 4 * 4, 8 + 2 + 4 * 4 + 8];

fn with_times(first: u64, last: u64) -> Vec<u8> {
    let mut bytes = file();
    let start = [&[STATISTICS], &56_u64.to_le_bytes()[..], &[100, 0, 0, 0]].concat();
    let record = position(&bytes, &start) + 9;
    for (offset, time) in TIMES.into_iter().zip([first, last]) {
        bytes[record + offset..][..8].copy_from_slice(&time.to_le_bytes());
    }
    bytes
}

/// Messages beyond the end that a file tells would not be played.
#[test]
fn times_that_are_not_those_of_the_chunks_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    for (first, last) in [(0, 50), (1, 99), (7, 7)] {
        fs::write(&path, with_times(first, last)).unwrap();
        let error = BagReader::open(&path).map(drop).unwrap_err();
        let damage = match &error {
            BagError::Damaged { source, .. } => source.to_string(),
            other => panic!("{other}"),
        };
        let told = format!("Some({:?})", (first, last));
        disagrees(&[damage], "log times", &told, "Some((0, 99))");
        // What there is, is readable.
        let (bag, _) = BagReader::open_damaged(&path).unwrap();
        assert_eq!(bag.times(), Some((0, 99)));
        assert!(bag.files().next().unwrap().fault.is_some());
    }
    // Wider ones are found where all is read; those of a recorder that tells none are those of the chunks.
    let faults_of = |first, last| faults(&path, &with_times(first, last));
    let found = faults_of(0, 100);
    disagrees(&found, "log times", "Some((0, 100))", "Some((0, 99))");
    assert_eq!(faults_of(0, 0).len() + faults_of(0, 99).len(), 0);
}
