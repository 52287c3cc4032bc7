//! What `recover` makes of bags as others make them.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use crate::common::{chunks, payload, read_all, topic};
use lgvi_bag::{
    BagError, BagOptions, BagWriter, Compression, Qos, RecoverError, recover, recover_in_place,
};
use mcap::{WriteOptions, records::MessageHeader};
use tempfile::TempDir;

/// Two files of five messages each; the folder, and the bag in it.
fn bag(compression: Compression) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let options = BagOptions {
        compression,
        ..BagOptions::default()
    };
    let mut writer = BagWriter::create(&directory, options).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    for number in 0..10 {
        if number == 5 {
            writer.split().unwrap();
        }
        let time = u64::from(number);
        writer
            .write(id, time, time, number, &payload(number))
            .unwrap();
    }
    writer.finish(BTreeMap::new()).unwrap();
    (folder, directory)
}

fn edit_metadata(bag: &Path, edit: impl Fn(String) -> String) {
    let file = bag.join("metadata.yaml");
    let text = fs::read_to_string(&file).unwrap();
    let edited = edit(text.clone());
    assert_ne!(edited, text);
    fs::write(file, edited).unwrap();
}

/// Paths that begin with the bag's name, also where the directory has another one now.
#[test]
fn metadata_of_the_first_versions() {
    let (folder, bag) = bag(Compression::Zstd);
    edit_metadata(&bag, |text| {
        text.replace("- run_", "- run/run_")
            .replace("path: run_", "path: run/run_")
            .replace("version: 9", "version: 3")
    });
    let renamed = folder.path().join("renamed");
    fs::rename(&bag, &renamed).unwrap();
    let output = folder.path().join("new");
    let recovery = recover(&renamed, &output).unwrap();
    assert_eq!((recovery.missing, recovery.files.len()), (Some(0), 2));
    assert!(recovery.is_whole());
    assert_eq!(read_all(&output).unwrap(), read_all(&renamed).unwrap());
}

/// Files in folders stay there, also those of one name.
#[test]
fn files_in_folders() {
    let (folder, bag) = bag(Compression::Zstd);
    for (number, name) in [(0, "a"), (1, "b")] {
        fs::create_dir(bag.join(name)).unwrap();
        let file = bag.join(format!("run_{number}.mcap"));
        fs::rename(file, bag.join(name).join("x.mcap")).unwrap();
    }
    edit_metadata(&bag, |text| {
        text.replace("run_0", "a/x").replace("run_1", "b/x")
    });
    let all = read_all(&bag).unwrap();
    assert_eq!(all.len(), 10);
    let output = folder.path().join("new");
    assert!(recover(&bag, &output).unwrap().is_whole());
    assert!(output.join("b/x.mcap").is_file());
    assert_eq!(read_all(&output).unwrap(), all);

    let damaged = bag.join("a/x.mcap");
    let mut bytes = fs::read(&damaged).unwrap();
    let place = chunks(&bytes)[0].end - 20;
    bytes[place] ^= 1;
    fs::write(&damaged, &bytes).unwrap();
    let recovery = recover_in_place(&bag).unwrap();
    assert_eq!(recovery.missing, Some(5));
    assert_eq!(read_all(&bag).unwrap(), all[5..]);
    assert_eq!(fs::read(bag.join("a/x.mcap.damaged")).unwrap(), bytes);
    let mut left: Vec<_> = fs::read_dir(&bag)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    left.sort();
    assert_eq!(left, ["a", "b", "metadata.yaml"]);
}

/// "none" is as good a name for no compression as an empty one.
#[test]
fn chunks_that_say_that_they_are_not_compressed() {
    let (folder, bag) = bag(Compression::None);
    let bytes = fs::read(bag.join("run_0.mcap")).unwrap();
    let chunk = chunks(&bytes)[0].clone();
    // The name's length lies behind two times, a length and a checksum.
    let name = chunk.start + 9 + 28;
    assert_eq!(bytes[name..name + 4], [0; 4]);
    let length = (chunk.len() - 9 + 4) as u64;
    let mut named = bytes[..=chunk.start].to_vec();
    named.extend(length.to_le_bytes());
    named.extend(&bytes[chunk.start + 9..name]);
    named.extend(4_u32.to_le_bytes());
    named.extend(b"none");
    named.extend(&bytes[name + 4..chunk.end]);
    let file = folder.path().join("none.mcap");
    fs::write(&file, named).unwrap();
    let recovery = recover(&file, &folder.path().join("new")).unwrap();
    assert_eq!(recovery.messages["/a"], 5);
    assert_eq!(recovery.files[0].left_out_places, 0);
}

/// A message that rosbag2 compressed by itself, and another whose frame is damaged.
#[test]
fn messages_compressed_by_themselves() {
    let folder = tempfile::tempdir().unwrap();
    let damaged = folder.path().join("run");
    let mut writer = BagWriter::create(&damaged, BagOptions::default()).unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    let good = zstd::encode_all(&payload(0)[..], 0).unwrap();
    let bad = [&good[..4], &[0; 40]].concat();
    for (sequence, data) in (0..).zip([&good, &bad]) {
        let time = u64::from(sequence);
        writer.write(id, time, time, sequence, data).unwrap();
    }
    writer.finish(BTreeMap::new()).unwrap();

    let output = folder.path().join("new");
    let recovery = recover(&damaged, &output).unwrap();
    assert_eq!((recovery.messages["/a"], recovery.missing), (1, Some(1)));
    assert_eq!(recovery.files[0].left_out_places, 1);
    let read = read_all(&output).unwrap();
    assert_eq!(read.len(), 1);
    assert_eq!(read[0].data, payload(0));
}

/// Two messages of 50 MiB in one chunk, which the reader takes; one of more than 64 MiB it does not.
#[test]
fn chunks_as_large_as_the_reader_takes() {
    let folder = tempfile::tempdir().unwrap();
    let [file, output] = ["large.mcap", "new"].map(|name| folder.path().join(name));
    let write = |lengths: &[usize]| {
        let mut writer = WriteOptions::new()
            .profile("ros2")
            .chunk_size(None)
            .create(fs::File::create(&file).unwrap())
            .unwrap();
        let topic = topic("/a", Qos::default());
        let schema = writer
            .add_schema(&topic.type_name, "ros2msg", topic.definition.as_bytes())
            .unwrap();
        let channel_id = writer
            .add_channel(schema, "/a", "cdr", &BTreeMap::new())
            .unwrap();
        for (sequence, &length) in (0..).zip(lengths) {
            let header = MessageHeader {
                channel_id,
                sequence,
                log_time: 1,
                publish_time: 1,
            };
            writer
                .write_to_known_channel(&header, &vec![0; length])
                .unwrap();
        }
        writer.finish().unwrap();
    };
    write(&[50 << 20, 50 << 20]);
    assert_eq!(read_all(&file).unwrap().len(), 2);
    let recovery = recover(&file, &output).unwrap();
    assert_eq!((recovery.missing, recovery.is_whole()), (Some(0), true));
    assert_eq!(read_all(&output).unwrap().len(), 2);
    fs::remove_dir_all(&output).unwrap();

    write(&[10, 70 << 20, 10]);
    assert!(read_all(&file).is_err());
    let recovery = recover(&file, &output).unwrap();
    assert_eq!(recovery.missing, Some(1));
    assert_eq!(recovery.files[0].left_out_places, 1);
    assert_eq!(read_all(&output).unwrap().len(), 2);
}

#[test]
fn other_storages_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for (name, start, tool) in [
        ("run_0.db3", "SQLite format 3\0", "ros2 bag convert"),
        ("run.bag", "#ROSBAG V2.0\n", "rosbags-convert"),
    ] {
        let file = folder.path().join(name);
        fs::write(&file, start).unwrap();
        let error = recover(&file, &folder.path().join("new")).unwrap_err();
        let is_storage = matches!(&error, RecoverError::Bag(BagError::Storage { .. }));
        assert!(is_storage && error.to_string().contains(tool), "{error}");
        fs::remove_file(&file).unwrap();
    }
}

/// Behind the last chunk nothing is left that holds messages, wherever the file is cut there.
#[test]
fn a_file_that_is_cut_behind_its_data() {
    let (folder, bag) = bag(Compression::Zstd);
    for name in ["metadata.yaml", "run_1.mcap"] {
        fs::remove_file(bag.join(name)).unwrap();
    }
    let file = bag.join("run_0.mcap");
    let bytes = fs::read(&file).unwrap();
    let end = chunks(&bytes)[0].end;
    for length in end..bytes.len() {
        fs::write(&file, &bytes[..length]).unwrap();
        let output = folder.path().join("new");
        let recovery = recover(&bag, &output).unwrap();
        assert_eq!(recovery.messages["/a"], 5);
        let left_out = &recovery.files[0].left_out;
        assert!(recovery.is_whole(), "cut to {length}: {left_out:?}");
        fs::remove_dir_all(&output).unwrap();
    }
}
