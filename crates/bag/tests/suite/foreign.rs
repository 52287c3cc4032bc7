//! The Python packages `rosbags` and `mcap` read split bags as they were written, and agree on every value.

use std::{
    collections::BTreeMap,
    num::NonZeroU64,
    path::{Path, PathBuf},
    process::Command,
};

use crate::common::{latched, payload, topic};
use lgvi_bag::{BagOptions, BagWriter, Compression, Qos};

fn run(program: impl AsRef<Path>, script: &str, arguments: &[&Path]) -> String {
    let scripts = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/python");
    let output = Command::new(program.as_ref())
        .arg(scripts.join(script))
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    assert!(output.status.success(), "{}", text(output.stderr));
    text(output.stdout).trim().to_owned()
}

#[test]
fn split_bags() {
    let python = run("python3", "environment.py", &[]);
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().join("run");
        let options = BagOptions {
            compression,
            max_bytes: NonZeroU64::new(30_000),
            max_duration: None,
        };
        let mut writer = BagWriter::create(&directory, options).unwrap();
        let map = writer.add_topic(&latched("/map", 2)).unwrap();
        let stream = writer.add_topic(&topic("/stream", Qos::default())).unwrap();
        writer.add_topic(&topic("/silent", Qos::default())).unwrap();
        for k in 0..1_000 {
            let topic = if k < 3 { map } else { stream };
            let time = 1_000 + u64::from(k);
            writer.write(topic, time, time, k, &payload(k)).unwrap();
        }
        writer.split().unwrap();
        let custom = BTreeMap::from([("scene".to_owned(), "dumbbells".to_owned())]);
        let summary = writer.finish(custom).unwrap();
        let files = summary.files.len();
        assert!((4..10).contains(&files), "{files}");

        let said = run(&python, "check_bag.py", &[&directory]);
        let said: serde_json::Value = serde_json::from_str(&said).unwrap();
        assert_eq!(said["counts"]["/stream"], 997);
        assert_eq!(said["counts"]["/map"], 3 + 2 * (files - 1));
        assert_eq!(said["counts"]["/silent"], 0);
        assert_eq!(summary.repeated, 2 * (files as u64 - 1));
        assert_eq!(said["custom"]["scene"], "dumbbells");
        assert_eq!(
            (&said["start_time"], &said["end_time"]),
            (&1_000.into(), &2_000.into())
        );
    }
}
