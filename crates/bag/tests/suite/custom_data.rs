//! Custom data stand in the bag, in each of its files, and in those that never get their end.

use std::{collections::BTreeMap, path::Path};

use crate::common::{McapFile, metadata_records, payload, topic};
use lgvi_bag::{BagOptions, BagReader, BagWriter, Qos};

fn lost(count: u32) -> BTreeMap<String, String> {
    BTreeMap::from([("lost".to_owned(), count.to_string())])
}

/// What the records of a file say that are written with each flush.
fn flushed(file: &Path) -> Vec<BTreeMap<String, String>> {
    let records = metadata_records(file).into_iter();
    let records = records.filter(|(name, _)| name == "lgvi_custom_data");
    records.map(|(_, custom)| custom).collect()
}

#[test]
fn a_flush_makes_them_safe_where_they_have_changed() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = BagWriter::create(&directory, BagOptions::default()).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    let first = writer.path();
    let mut expected = Vec::new();
    for (sequence, count) in [0, 0, 7, 7, 9].into_iter().enumerate() {
        writer
            .write(id, sequence as u64, 0, sequence as u32, &payload(0))
            .unwrap();
        writer.set_custom(lost(count));
        writer.flush().unwrap();
        expected.push(lost(count));
        expected.dedup();
        assert_eq!(flushed(&first), expected);
    }
    writer.split().unwrap();
    assert_eq!(flushed(&first), expected, "the file's end has them");
    assert_eq!(McapFile::read(&first).rosbag2()["custom_data"]["lost"], "9");
    let second = writer.path();
    writer.flush().unwrap();
    assert_eq!(flushed(&second), [lost(9)], "each file has its own");
    writer.finish(lost(11)).unwrap();
    assert_eq!(
        McapFile::read(&second).rosbag2()["custom_data"]["lost"],
        "11"
    );
    assert_eq!(*BagReader::open(&directory).unwrap().custom(), lost(11));
}

/// As are the lists of tens of thousands of files.
#[test]
fn descriptions_of_many_megabytes_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let writer = BagWriter::create(&directory, BagOptions::default()).unwrap();
    let custom = BTreeMap::from([("note".to_owned(), "x".repeat(20 << 20))]);
    writer.finish(custom.clone()).unwrap();
    assert_eq!(*BagReader::open(&directory).unwrap().custom(), custom);
}
