//! Bounds on what descriptions and indexes of bags may take.

use std::{collections::BTreeMap, fs};

use crate::common::{latched, topic};
use lgvi_bag::{BagOptions, BagReader, BagWriter, Compression, Qos};

/// Why a `metadata.yaml` is refused.
fn refusal(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("metadata.yaml"), text).unwrap();
    let opened = BagReader::open(folder.path()).map(drop);
    let error = opened.unwrap_err().to_string();
    let (_, reason) = error.split_once("metadata.yaml: ").unwrap();
    reason.to_owned()
}

#[test]
fn bombs_of_yaml_are_refused() {
    let nested = |depth: usize| "[".repeat(depth) + &"]".repeat(depth);
    assert_eq!(refusal(&nested(65)), "line 1: nested more than 64 deep");
    assert!(refusal(&nested(64)).contains("invalid type"));
    refusal(&"[".repeat(64 << 20));
    let aliases = "a: &a [x]\nb: [*a, *a]\n";
    assert_eq!(refusal(aliases), "line 2: an alias");
    let many = format!("[{}]", "0,".repeat(2 << 20));
    let expected = "line 1: more than 2097152 scalars and brackets";
    assert_eq!(refusal(&many), expected);
    let long = " ".repeat((64 << 20) + 1);
    let expected = "67108865 bytes of YAML, expected at most 67108864";
    assert_eq!(refusal(&long), expected);
    // What looks like an alias in a text is none.
    let text = refusal("a: &anchor 'b * c & *d'\n");
    assert!(text.contains("missing field"), "{text}");
}

/// However many chunks are flushed, the index of a file takes no more than 64 MiB of memory: then the next one begins.
#[test]
fn the_memory_of_indexes_is_bounded() {
    const TOPICS: u64 = 1_000;
    // Each chunk has an entry of 160 bytes, and 40 bytes for each of its channels.
    const CHUNKS: u64 = 1 + (64 << 20) / (160 + 40 * TOPICS);
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let options = BagOptions {
        compression: Compression::None,
        ..BagOptions::default()
    };
    let mut writer = BagWriter::create(&directory, options).unwrap();
    let topics = (0..TOPICS).map(|index| topic(&format!("/{index}"), Qos::default()));
    let topics: Vec<_> = topics
        .map(|topic| writer.add_topic(&topic).unwrap())
        .collect();
    let first = writer.path();
    for time in 0..=CHUNKS {
        for topic in &topics {
            writer.write(*topic, time, time, 0, &[]).unwrap();
        }
        writer.flush().unwrap();
        assert_eq!(writer.path() == first, time < CHUNKS, "{time} of {CHUNKS}");
    }
    let summary = writer.finish(BTreeMap::new()).unwrap();
    assert_eq!(summary.files.len(), 2);
    assert!(summary.messages.values().all(|count| *count == CHUNKS + 1));
}

/// The order of files without `metadata.yaml`, and those that are missing among them.
#[test]
fn files_are_in_the_order_of_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let written = folder.path().join("written");
    let writer = BagWriter::create(&written, BagOptions::default()).unwrap();
    let file = writer.finish(BTreeMap::new()).unwrap().files.remove(0);
    let read = |name: &str, names: &[&str]| {
        let directory = folder.path().join(name);
        fs::create_dir(&directory).unwrap();
        for name in names {
            fs::copy(&file, directory.join(name).with_added_extension("mcap")).unwrap();
        }
        let bag = BagReader::open(&directory).unwrap();
        let stem = |path: &std::path::Path| path.file_stem().unwrap().to_str().unwrap().to_owned();
        let missing = bag.missing().into_iter().map(|error| error.to_string());
        let missing: Vec<String> = missing
            .map(|text| stem(text.split_once(".mcap").unwrap().0.as_ref()))
            .collect();
        (
            bag.files().map(|file| stem(file.path)).collect::<Vec<_>>(),
            missing,
        )
    };
    let names = ["run_10", "run_9", "run_100", "run_2", "run_99", "run"];
    let ordered = ["run", "run_2", "run_9", "run_10", "run_99", "run_100"];
    assert_eq!(read("order", &names).0, ordered);
    let gaps = read("gaps", &["a_0", "a_3", "b_0", "b_1"]).1;
    assert_eq!(gaps, ["a_1", "a_2"]);
    assert!(read("late", &["a_5", "a_7"]).1.is_empty());
    assert!(read("dates", &["a_0", "a_20240131"]).1.is_empty());
    assert!(read("others", &["a_0", "a_02", "a", "7"]).1.is_empty());
}

/// Paths in `metadata.yaml` of any version lead to files within the bag, and nowhere else.
#[test]
fn paths_stay_within_the_bag() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = BagWriter::create(&directory, BagOptions::default()).unwrap();
    writer.add_topic(&latched("/a", 1)).unwrap();
    writer.finish(BTreeMap::new()).unwrap();
    fs::create_dir(directory.join("sub")).unwrap();
    fs::copy(
        directory.join("run_0.mcap"),
        directory.join("sub/run_0.mcap"),
    )
    .unwrap();
    let metadata = directory.join("metadata.yaml");
    let text = fs::read_to_string(&metadata).unwrap();
    for (listed, version, expected) in [
        ("run_0.mcap", 9, Some("run_0.mcap")),
        ("./run_0.mcap", 5, Some("run_0.mcap")),
        ("sub/run_0.mcap", 4, Some("sub/run_0.mcap")),
        ("run/run_0.mcap", 3, Some("run_0.mcap")),
        ("run/sub/run_0.mcap", 3, Some("sub/run_0.mcap")),
        ("run_0.mcap", 3, Some("run_0.mcap")),
        ("/run_0.mcap", 9, None),
        ("../run/run_0.mcap", 9, None),
        ("a/../../run/run_0.mcap", 9, None),
        ("''", 9, None),
        (".", 9, None),
    ] {
        let changed = text.replace("  - run_0.mcap", &format!("  - {listed}"));
        let changed = changed.replace("version: 9", &format!("version: {version}"));
        fs::write(&metadata, changed).unwrap();
        let bag = BagReader::open(&directory).ok();
        let found = bag.and_then(|bag| bag.files().next().map(|file| file.path.to_owned()));
        assert_eq!(found, expected.map(|name| directory.join(name)), "{listed}");
    }
}
