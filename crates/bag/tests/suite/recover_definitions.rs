//! What `recover` makes of damaged definitions, of which one stands for all messages of its topics.

use std::{
    fs,
    ops::Range,
    path::{Path, PathBuf},
};

use crate::common::{Read, chunks, kill, payload, read_all, topic};
use lgvi_bag::{BagOptions, BagReader, BagWriter, Compression, Qos, RecoverError, Topic, recover};
use mcap::records::op;
use tempfile::TempDir;

/// A definition that only the bag has.
const OTHER: &str = "float64 distance  # m\nOther[3] parts\n\
    ================================================================================\n\
    MSG: other_msgs/Other\nstring<=8 name\n";

fn other() -> Topic {
    Topic {
        type_name: "other_msgs/msg/Distance".to_owned(),
        type_hash: format!("RIHS01_{}", "5a".repeat(32)),
        definition: OTHER.to_owned(),
        ..topic("/other", Qos::default())
    }
}

/// A bag of `files` files of eight messages, of which the last one has no end: its recorder was killed.
fn killed(files: u32, compression: Compression) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir_in("/dev/shm").unwrap_or_else(|_| tempfile::tempdir().unwrap());
    let directory = folder.path().join("run");
    let options = BagOptions {
        compression,
        ..BagOptions::default()
    };
    let mut writer = BagWriter::create(&directory, options).unwrap();
    let topics =
        [topic("/known", Qos::default()), other()].map(|topic| writer.add_topic(&topic).unwrap());
    for number in 0..8 * files {
        if number > 0 && number.is_multiple_of(8) {
            writer.split().unwrap();
        }
        let time = u64::from(number);
        let topic = topics[number as usize % 2];
        writer
            .write(topic, time, time, number, &payload(number))
            .unwrap();
        if number.is_multiple_of(4) {
            writer.flush().unwrap();
        }
    }
    writer.flush().unwrap();
    kill(writer);
    (folder, directory)
}

/// Takes the definitions out of the chunks of a file without compression and puts them before, as earlier versions did.
fn without_copies(file: &Path) {
    const HEADER: usize = 9 + 32;
    let bytes = fs::read(file).unwrap();
    let chunks = chunks(&bytes);
    let mut out = bytes[..chunks[0].start].to_vec();
    let all = records(&bytes[chunks[0].start + HEADER + 8..chunks[0].end]);
    out.extend(all.filter(|record| record[0] != op::MESSAGE).flatten());
    let mut end = chunks[0].start;
    for chunk in chunks {
        out.extend_from_slice(&bytes[end..chunk.start]);
        end = chunk.end;
        let messages: Vec<_> = records(&bytes[chunk.start + HEADER + 8..chunk.end])
            .filter(|record| record[0] == op::MESSAGE)
            .collect();
        let data = messages.concat();
        let length = data.len() as u64;
        let mut header = bytes[chunk.start..chunk.start + HEADER].to_vec();
        header[1..9].copy_from_slice(&(32 + 8 + length).to_le_bytes());
        header[25..33].copy_from_slice(&length.to_le_bytes());
        header[33..37].copy_from_slice(&crc32fast::hash(&data).to_le_bytes());
        out.extend([&header[..], &length.to_le_bytes(), &data].concat());
    }
    out.extend_from_slice(&bytes[end..]);
    fs::write(file, out).unwrap();
}

fn records(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut left = bytes;
    std::iter::from_fn(move || {
        let (_, length) = left.split_first()?;
        let length = u64::from_le_bytes(*length.first_chunk()?);
        let (record, rest) = left.split_at(9 + length as usize);
        left = rest;
        Some(record)
    })
}

/// Where the definitions at the head of a file are.
fn head(bytes: &[u8]) -> Range<usize> {
    let header = u64::from_le_bytes(*bytes[9..].first_chunk().unwrap()) as usize;
    8 + 9 + header..chunks(bytes)[0].start
}

fn flip(file: &Path, bytes: &[u8], position: usize, bit: u8) {
    let mut damaged = bytes.to_vec();
    damaged[position] ^= bit;
    fs::write(file, damaged).unwrap();
}

/// Topics and messages of a bag.
fn contents(bag: &Path) -> (Vec<Topic>, Vec<Read>) {
    let topics = BagReader::open(bag).unwrap().topics().to_vec();
    (topics, read_all(bag).unwrap())
}

#[test]
fn any_bit_of_a_killed_bag_s_head() {
    for compression in [Compression::None, Compression::Zstd] {
        let (folder, bag) = killed(1, compression);
        let [whole, output] = ["whole", "new"].map(|name| folder.path().join(name));
        assert!(recover(&bag, &whole).unwrap().is_whole());
        let expected = contents(&whole);
        assert_eq!((expected.0.len(), expected.1.len()), (2, 8));
        let file = bag.join("run_0.mcap");
        let bytes = fs::read(&file).unwrap();
        for position in 8..head(&bytes).end {
            flip(&file, &bytes, position, 1 << (position % 8));
            recover(&bag, &output).unwrap_or_else(|error| panic!("byte {position}: {error}"));
            assert!(contents(&output) == expected, "byte {position}");
            fs::remove_dir_all(&output).unwrap();
        }
    }
}

/// Where the definitions stand at the head only, as earlier versions wrote them, no checksum covers them. Messages that are
/// lost with a damaged one are reported.
#[test]
fn definitions_without_copies() {
    let (folder, bag) = killed(1, Compression::None);
    let [whole, output] = ["whole", "new"].map(|name| folder.path().join(name));
    let file = bag.join("run_0.mcap");
    without_copies(&file);
    let bytes = fs::read(&file).unwrap();
    assert!(recover(&bag, &whole).unwrap().is_whole());
    let expected = contents(&whole).1;
    let mut lost = 0;
    for position in head(&bytes) {
        flip(&file, &bytes, position, 1 << (position % 8));
        match recover(&bag, &output) {
            Ok(recovery) => {
                let found = contents(&output).1.len();
                assert!(
                    found == expected.len() || !recovery.is_whole(),
                    "byte {position}"
                );
                lost += usize::from(found < expected.len());
                fs::remove_dir_all(&output).unwrap();
            }
            Err(RecoverError::Nothing { .. }) => lost += 1,
            Err(error) => panic!("byte {position}: {error}"),
        }
    }
    assert!((1..head(&bytes).len() / 4).contains(&lost), "{lost}");
}

/// No message is lost where no chunk begins.
#[test]
fn a_bag_that_is_cut_before_its_first_message() {
    let (folder, bag) = killed(1, Compression::Zstd);
    let output = folder.path().join("new");
    let file = bag.join("run_0.mcap");
    let bytes = fs::read(&file).unwrap();
    let head = head(&bytes);
    for length in 0..=head.end + 1 {
        fs::write(&file, &bytes[..length]).unwrap();
        let result = recover(&bag, &output);
        if (head.start..=head.end).contains(&length) {
            let recovery = result.unwrap_or_else(|error| panic!("cut to {length}: {error}"));
            assert!(recovery.is_whole() && recovery.messages.values().sum::<u64>() == 0);
            assert!(read_all(&output).unwrap().is_empty());
            fs::remove_dir_all(&output).unwrap();
        } else {
            let nothing = matches!(result, Err(RecoverError::Nothing { .. }));
            assert!(nothing, "cut to {length}");
        }
    }
}
