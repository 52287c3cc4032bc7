//! What the record of a file lists of the files before it.

use std::{collections::BTreeMap, fs};

use crate::common::{McapFile, metadata, payload, topic};
use lgvi_bag::{BagOptions, BagWriter, Qos};

/// The size of a bag of many files grows with their number, not with its square.
#[test]
fn only_so_many_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = BagWriter::create(&directory, BagOptions::default()).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    for time in 0..200 {
        writer.split().unwrap();
        writer.write(id, time, time, 0, &payload(0)).unwrap();
    }
    let summary = writer.finish(BTreeMap::new()).unwrap();
    for (index, file) in summary.files.iter().enumerate() {
        let told = McapFile::read(file).rosbag2();
        let listed = (index.saturating_sub(64)..=index).map(|file| format!("run_{file}.mcap"));
        let listed: Vec<_> = listed.collect();
        let paths: Vec<String> =
            serde_yaml_ng::from_value(told["relative_file_paths"].clone()).unwrap();
        assert_eq!(paths, listed);
        assert_eq!(told["files"].as_sequence().unwrap().len(), listed.len());
        // Of all files.
        assert_eq!(told["message_count"], index as u64 + 1);
        assert_eq!(told["starting_time"]["nanoseconds_since_epoch"], 0);
    }
    let size = |file: usize| fs::metadata(&summary.files[file]).unwrap().len();
    assert!(10 * size(199) < 11 * size(64), "{} {}", size(199), size(64));
    let whole = metadata(&directory);
    assert_eq!(whole["files"].as_sequence().unwrap().len(), 200);
}
