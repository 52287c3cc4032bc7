//! What recorders that are killed have told of themselves in their files.

use std::{collections::BTreeMap, fs};

use crate::common::{chunks, kill, payload, read_all, topic};
use lgvi_bag::{BagOptions, BagReader, BagWriter, Qos, recover};
use mcap::records::op;

/// A record of metadata with one entry.
fn record(name: &str, key: &str, value: &str) -> Vec<u8> {
    let field = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let entry = [field(key), field(value)].concat();
    let length = (entry.len() as u32).to_le_bytes();
    let body = [&field(name)[..], &length, &entry].concat();
    [
        &[op::METADATA],
        &(body.len() as u64).to_le_bytes()[..],
        &body,
    ]
    .concat()
}

fn described(lost: &str, more: &str) -> Vec<u8> {
    let text = format!("version: 9\n{more}custom_data:\n  lost: '{lost}'\n");
    record("rosbag2", "serialized_metadata", &text)
}

fn flushed(lost: &str) -> Vec<u8> {
    record("lgvi_custom_data", "lost", lost)
}

/// The last record counts of those that can be read.
#[test]
fn custom_data_of_a_file_without_end() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("run");
    let mut writer = BagWriter::create(&bag, BagOptions::default()).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    for time in 0..2 {
        writer.write(id, time, time, 0, &payload(0)).unwrap();
        writer.set_custom(BTreeMap::from([("lost".to_owned(), "0".to_owned())]));
        writer.flush().unwrap();
    }
    kill(writer);
    let file = bag.join("run_0.mcap");
    let bytes = fs::read(&file).unwrap();
    let place = chunks(&bytes)[1].start;
    let cut = flushed("5");
    let damaged = described("4", "custom_data: {}\n");
    for (name, between, behind, lost) in [
        ("none", Vec::new(), Vec::new(), "0"),
        ("flushed", described("1", ""), flushed("2"), "2"),
        ("described", flushed("1"), described("3", ""), "3"),
        ("damaged", flushed("1"), damaged, "1"),
    ] {
        let parts = [&bytes[..place], &between, &bytes[place..], &behind];
        fs::write(&file, [&parts.concat(), &cut[..cut.len() - 3]].concat()).unwrap();
        let output = folder.path().join(name);
        let recovery = recover(&bag, &output).unwrap();
        assert!(recovery.is_whole(), "{name}: {recovery:?}");
        let custom = BagReader::open(&output).unwrap().custom().clone();
        let custom: Vec<_> = custom
            .iter()
            .map(|(key, value)| (&**key, &**value))
            .collect();
        assert_eq!(custom, [("lost", lost), ("recovered", "true")], "{name}");
        assert_eq!(read_all(&output).unwrap().len(), 2);
    }
}
