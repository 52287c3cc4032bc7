//! Bags that the Python package `rosbags` writes, of every version and compression.

use std::{path::Path, process::Command};

use crate::common::read_all;
use lgvi_bag::{BagError, BagReader};
use lgvi_msgs::{cdr, std_msgs::String as Text};

fn python(program: &str, script: &str, argument: Option<&Path>) -> String {
    let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/python");
    let output = Command::new(program)
        .arg(scripts.join(script))
        .args(argument)
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}

#[test]
fn bags_of_rosbags() {
    let folder = tempfile::tempdir().unwrap();
    let interpreter = python("python3", "environment.py", None);
    python(&interpreter, "write_bags.py", Some(folder.path()));
    for version in [8, 9] {
        for mode in ["none", "file", "message", "storage"] {
            let directory = folder.path().join(format!("mcap_{version}_{mode}"));
            let bag = BagReader::open(&directory).unwrap();
            assert_eq!(bag.message_counts()["/chatter"], 100, "{mode}");
            assert_eq!(bag.message_counts()["/silent"], 0, "{mode}");
            assert_eq!(bag.custom()["made_by"], "rosbags");
            let start = 1_700_000_000_000_000_000;
            assert_eq!(bag.times(), Some((start, start + 990_000_000)));

            let messages = read_all(&directory).unwrap();
            assert_eq!(messages.len(), 100, "{mode}");
            for (number, message) in messages.iter().enumerate() {
                let text: Text = cdr::decode(&message.data).unwrap();
                assert_eq!(text.data, format!("message {number}"), "{mode}");
                assert_eq!(message.log_time, start + number as u64 * 10_000_000);
            }
        }
    }
    let error = BagReader::open(&folder.path().join("sqlite3")).map(drop);
    assert!(matches!(error, Err(BagError::Storage { found, .. }) if found == "sqlite3"));
}
