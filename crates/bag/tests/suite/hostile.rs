//! Files that somebody has made to cost memory or time.

use std::{collections::BTreeMap, fs, path::Path, process::Command, time::Instant};

use crate::common::{read_all, topic};
use lgvi_bag::{BagError, BagOptions, BagReader, BagWriter, Compression, Qos};

fn write_bag(directory: &Path, compression: Compression, messages: u32, payload: &[u8]) -> Vec<u8> {
    let options = BagOptions {
        compression,
        ..BagOptions::default()
    };
    let mut writer = BagWriter::create(directory, options).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    for sequence in 0..messages {
        writer.write(id, 0, 0, 2 * sequence, &[0; 8]).unwrap();
        writer.write(id, 9, 9, 2 * sequence + 1, payload).unwrap();
        writer.flush().unwrap();
    }
    writer.finish(BTreeMap::new()).unwrap();
    fs::read(directory.join("run_0.mcap")).unwrap()
}

fn damage_of(path: &Path) -> String {
    match read_all(path).err().unwrap() {
        BagError::Damaged { source, .. } => source.to_string(),
        other => panic!("{other}"),
    }
}

/// Place of the body of each record with this operation code, from the header on.
fn bodies(file: &[u8], wanted: u8) -> Vec<usize> {
    let (mut at, mut found) = (8, Vec::new());
    while at + 17 <= file.len() {
        let length = u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap());
        if file[at] == wanted {
            found.push(at + 9);
        }
        at += 9 + length as usize;
    }
    found
}

const CHUNK: u8 = 0x06;

#[test]
fn a_record_that_is_longer_than_its_chunk_is_damage() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut file = write_bag(&directory, Compression::None, 1, &[0; 64]);
    // Two times, size and checksum, the name of no compression, and then what is said to be the records' length.
    let chunk = bodies(&file, CHUNK)[0];
    let length = file[chunk + 32..chunk + 40].first_chunk::<8>().copied();
    let shorter = u64::from_le_bytes(length.unwrap()) - 1;
    file[chunk + 32..chunk + 40].copy_from_slice(&shorter.to_le_bytes());
    fs::write(directory.join("run_0.mcap"), file).unwrap();
    let damage = damage_of(&directory);
    assert!(damage.starts_with("length of the chunk: "), "{damage}");
}

#[test]
fn what_is_no_file_is_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("run_0.mcap");
    let made = Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    let bag = folder.path().join("bag");
    fs::create_dir(&bag).unwrap();
    let made = Command::new("mkfifo")
        .arg(bag.join("metadata.yaml"))
        .status();
    assert!(made.unwrap().success());
    let begun = Instant::now();
    for path in [&pipe, folder.path(), &bag, Path::new("/dev/zero")] {
        let error = BagReader::open(path).err().unwrap();
        assert!(matches!(error, BagError::Io(..)), "{error}");
    }
    assert!(begun.elapsed().as_secs() < 5);
}

/// What the reader would refuse is not taken into a recovered bag.
#[test]
fn a_recovered_bag_has_what_can_be_read_only() {
    let folder = tempfile::tempdir().unwrap();
    let damaged = folder.path().join("bag_0.mcap");
    let mut file = mcap::Writer::new(fs::File::create(&damaged).unwrap()).unwrap();
    let schema = file.add_schema("a/msg/A", "ros2msg", b"bool a\n").unwrap();
    let qos = |text: &str| BTreeMap::from([("offered_qos_profiles".to_owned(), text.to_owned())]);
    let channels = [
        ("/json", "json", BTreeMap::new()),
        ("/good", "cdr", qos("[]")),
        ("/damaged", "cdr", qos("- history: [")),
    ];
    for (topic, encoding, metadata) in channels {
        let channel_id = file
            .add_channel(schema, topic, encoding, &metadata)
            .unwrap();
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: 0,
            log_time: 5,
            publish_time: 5,
        };
        file.write_to_known_channel(&header, &[0, 1, 0, 0, 1])
            .unwrap();
    }
    file.finish().unwrap();
    drop(file);

    let output = folder.path().join("recovered");
    let recovery = lgvi_bag::recover(&damaged, &output).unwrap();
    let bag = BagReader::open(&output).unwrap();
    let topics: Vec<_> = bag
        .messages()
        .map(|message| message.unwrap().topic.name.clone())
        .collect();
    assert_eq!(topics, ["/good", "/damaged"]);
    let reasons: Vec<_> = recovery.files[0]
        .left_out
        .iter()
        .map(|place| &*place.reason)
        .collect();
    let told = |text: &str| reasons.iter().any(|reason| reason.contains(text));
    assert!(told("are \"json\", expected \"cdr\""), "{reasons:?}");
    assert!(told("offered_qos_profiles of /damaged"), "{reasons:?}");
}
