//! Bags for conversion.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use lgvi_bag::{BagOptions, BagReader, BagWriter, Qos, Topic};

use super::little_endian;
use crate::{Format, Options, convert};

/// Creates a bag with the single topic `/topic` and messages with these bodies.
pub fn bag(directory: &Path, definition: &str, bodies: &[&[u8]]) -> BagReader {
    let path = directory.join("bag");
    let mut writer = BagWriter::create(&path, BagOptions::default()).unwrap();
    let topic = writer.add_topic(&topic("/topic", definition)).unwrap();
    for (number, body) in (0..).zip(bodies) {
        let times = (1_000 + u64::from(number), 900 + u64::from(number));
        let payload = little_endian(body);
        writer
            .write(topic, times.0, times.1, number, &payload)
            .unwrap();
    }
    writer.finish(BTreeMap::new()).unwrap();
    BagReader::open(&path).unwrap()
}

pub fn topic(name: &str, definition: &str) -> Topic {
    Topic {
        name: name.to_owned(),
        type_name: "pkg/msg/A".to_owned(),
        type_hash: String::new(),
        definition: definition.to_owned(),
        definition_encoding: lgvi_bag::ROS2MSG.to_owned(),
        qos: Qos::default(),
    }
}

pub fn options(format: Format) -> Options {
    Options {
        format,
        topics: Vec::new(),
        max_elements: 3,
    }
}

/// Converts a bag and returns the text of the CSV file.
pub fn csv(definition: &str, bodies: &[&[u8]]) -> String {
    let directory = tempfile::tempdir().unwrap();
    let bag = bag(directory.path(), definition, bodies);
    let output = directory.path().join("tables");
    let made = convert(&bag, &output, &options(Format::Csv)).unwrap();
    assert_eq!(made.left_out, []);
    assert_eq!(files(&output), ["topic.csv"]);
    fs::read_to_string(output.join("topic.csv")).unwrap()
}

pub fn files(directory: &Path) -> Vec<String> {
    let name = |entry: fs::DirEntry| entry.file_name().into_string().unwrap();
    let mut names: Vec<_> = fs::read_dir(directory)
        .unwrap()
        .map(|entry| name(entry.unwrap()))
        .collect();
    names.sort();
    names
}
