//! What `recover` makes of bags that are whole, cut off or damaged.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::{common, largest};

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use common::{Read, chunks, payload, random, read_all, topic};
use lgvi_bag::{
    BagError, BagOptions, BagReader, BagWriter, Compression, Qos, RecoverError, Recovery, recover,
    recover_in_place,
};
use tempfile::TempDir;

/// No bag of these tests is larger than a MiB; a decoder has buffers of its own.
const LARGEST_ALLOWED: usize = 16 << 20;

const ALL: [Compression; 3] = [Compression::None, Compression::Zstd, Compression::Lz4];

/// Every byte of one bag, and some of those that differ from it in their chunks' data only.
fn step(compression: Compression) -> usize {
    match compression {
        Compression::Zstd => 1,
        Compression::None | Compression::Lz4 => 19,
    }
}

fn latched() -> Qos {
    Qos {
        durable: true,
        depth: 2,
        ..Qos::default()
    }
}

/// A bag of `files` files, each with three chunks and two messages of a latched topic.
fn write_bag(directory: &Path, compression: Compression, files: u32) -> Vec<Read> {
    let options = BagOptions {
        compression,
        ..BagOptions::default()
    };
    let mut writer = BagWriter::create(directory, options).unwrap();
    let often = writer.add_topic(&topic("/often", Qos::default())).unwrap();
    let scene = writer.add_topic(&topic("/scene", latched())).unwrap();
    writer.add_topic(&topic("/silent", latched())).unwrap();
    for file in 0..files {
        for chunk in 0..3 {
            for number in 0..4 {
                let sequence = (file * 3 + chunk) * 4 + number;
                let time = 1000 + 10 * u64::from(sequence);
                writer
                    .write(often, time, time - 3, sequence, &payload(sequence))
                    .unwrap();
            }
            if chunk < 2 {
                let sequence = 2 * file + chunk;
                let time = 1005 + 10 * u64::from((file * 3 + chunk) * 4 + 3);
                writer
                    .write(scene, time, 7, sequence, &payload(1000 + sequence))
                    .unwrap();
            }
            writer.flush().unwrap();
        }
        if file + 1 < files {
            writer.split().unwrap();
        }
    }
    writer
        .finish(BTreeMap::from([("software".to_owned(), "lgvi".to_owned())]))
        .unwrap();
    read_all(directory).unwrap()
}

/// In memory where there is such a file system: these tests write many thousands of small files.
fn folder() -> TempDir {
    tempfile::tempdir_in("/dev/shm").unwrap_or_else(|_| tempfile::tempdir().unwrap())
}

fn mcap_files(directory: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(directory)
        .unwrap()
        .flatten()
        .map(|entry| entry.path());
    let mut files: Vec<_> = entries
        .filter(|path| path.extension().is_some_and(|it| it == "mcap"))
        .collect();
    files.sort();
    files
}

fn count(recovery: &Recovery) -> u64 {
    recovery.messages.values().sum()
}

#[test]
fn an_undamaged_bag_comes_out_equal() {
    for compression in ALL {
        let folder = folder();
        let [bag, output] = ["run", "new"].map(|name| folder.path().join(name));
        let original = write_bag(&bag, compression, 3);
        let recovery = recover(&bag, &output).unwrap();
        assert!(recovery.is_whole(), "{recovery:?}");
        assert!(recovery.files.iter().all(|file| file.complete && file.kept));
        assert_eq!(
            (recovery.unverified, recovery.metadata_rebuilt.as_deref()),
            (0, None)
        );
        assert_eq!(count(&recovery), original.len() as u64);
        assert_eq!(recovery.repeated, 4, "two at the head of each further file");
        assert_eq!(read_all(&output).unwrap(), original);

        let [before, after] = [&bag, &output].map(|bag| BagReader::open(bag).unwrap());
        assert_eq!(before.topics(), after.topics());
        assert_eq!(before.message_counts(), after.message_counts());
        assert_eq!(before.times(), after.times());
        let mut custom = before.custom().clone();
        custom.insert("recovered".to_owned(), "true".to_owned());
        assert_eq!(*after.custom(), custom);
        // Each file by itself, with what it repeats.
        for file in mcap_files(&bag) {
            let same = output.join(file.file_name().unwrap());
            assert_eq!(read_all(&file).unwrap(), read_all(&same).unwrap());
        }
        assert_eq!(mcap_files(&output).len(), 3);
    }
}

/// Cut at every byte: all messages of complete chunks are there, and no others that were not written.
#[test]
fn a_bag_that_is_cut_anywhere() {
    for compression in ALL {
        let folder = folder();
        let [bag, output] = ["run", "new"].map(|name| folder.path().join(name));
        let original = write_bag(&bag, compression, 1);
        fs::remove_file(bag.join("metadata.yaml")).unwrap();
        let file = bag.join("run_0.mcap");
        let bytes = fs::read(&file).unwrap();
        let mut most = 0;
        for length in (0..bytes.len())
            .step_by(step(compression))
            .chain([bytes.len()])
        {
            fs::write(&file, &bytes[..length]).unwrap();
            let recovery = match recover(&bag, &output) {
                Ok(recovery) => recovery,
                Err(RecoverError::Nothing { .. }) if most == 0 => continue,
                Err(error) => panic!("{compression:?} cut to {length}: {error}"),
            };
            let messages = read_all(&output).unwrap();
            assert_eq!(
                messages[..],
                original[..messages.len()],
                "{compression:?} cut to {length}"
            );
            assert!(
                messages.len() >= most,
                "{compression:?} cut to {length}: fewer than when cut before"
            );
            assert_eq!(count(&recovery), messages.len() as u64);
            assert_eq!(
                recovery.files[0].complete,
                length == bytes.len(),
                "cut to {length}"
            );
            assert!(recovery.metadata_rebuilt.is_some());
            most = messages.len();
            assert_eq!(
                fs::read(&file).unwrap(),
                bytes[..length],
                "the input has changed"
            );
            fs::remove_dir_all(&output).unwrap();
        }
        assert_eq!(most, original.len());
    }
}

/// One byte of every position changed: nothing comes out that was not in the bag, and what is lost is what one chunk has.
fn a_bag_with_any_byte_changed(compression: Compression, first: usize, step: usize) {
    let folder = folder();
    let [bag, output] = ["run", "new"].map(|name| folder.path().join(name));
    let original = write_bag(&bag, compression, 1);
    let file = bag.join("run_0.mcap");
    let bytes = fs::read(&file).unwrap();
    let mut damaged = bytes.clone();
    let (mut hurt, mut told) = (0, 0);
    largest::reset();
    for position in (first..bytes.len()).step_by(step) {
        let random = random(position as u64);
        let changes = [1 << (random >> 61), 0xff, (random as u8) | 1];
        let change = changes[position % 3];
        damaged[position] ^= change;
        fs::write(&file, &damaged).unwrap();
        let case = format!("{compression:?}, byte {position} ^ {change:#x}");
        let recovery = recover(&bag, &output).unwrap_or_else(|error| panic!("{case}: {error}"));
        let messages = read_all(&output).unwrap_or_else(|error| panic!("{case}: {error}"));
        let mut left = original.iter();
        let all_original = messages
            .iter()
            .all(|message| left.any(|known| known == message));
        assert!(all_original, "{case}: messages that were not in the bag");
        let lost = original.len() - messages.len();
        assert!(lost <= 5, "{case}: {lost} messages lost: {recovery:?}");
        hurt += usize::from(lost > 0);
        told += usize::from(lost > 0 && !recovery.is_whole());
        damaged[position] = bytes[position];
        fs::remove_dir_all(&output).unwrap();
    }
    assert_eq!(told, hurt, "losses that nobody is told of");
    assert!(hurt > bytes.len() / step / 10, "{hurt} of {}", bytes.len());
    let largest = largest::largest();
    assert!(largest <= LARGEST_ALLOWED, "{largest} bytes");
}

#[test]
fn a_bag_of_zstd_with_any_even_byte_changed() {
    a_bag_with_any_byte_changed(Compression::Zstd, 0, 2);
}

#[test]
fn a_bag_of_zstd_with_any_odd_byte_changed() {
    a_bag_with_any_byte_changed(Compression::Zstd, 1, 2);
}

#[test]
fn other_bags_with_some_byte_changed() {
    for compression in [Compression::None, Compression::Lz4] {
        a_bag_with_any_byte_changed(compression, 0, step(compression));
    }
}

/// Absurd numbers at every second byte: what lengths are made of begins with one, or one byte behind.
#[test]
fn absurd_lengths() {
    let folder = folder();
    let [bag, output] = ["run", "new"].map(|name| folder.path().join(name));
    let original = write_bag(&bag, Compression::Lz4, 1);
    let file = bag.join("run_0.mcap");
    let bytes = fs::read(&file).unwrap();
    for position in (0..bytes.len() - 8).step_by(2) {
        let mut damaged = bytes.clone();
        let value = [u64::MAX, 1 << 40, 64 << 20, 0][position / 2 % 4];
        damaged[position..position + 8].copy_from_slice(&value.to_le_bytes());
        fs::write(&file, &damaged).unwrap();
        recover(&bag, &output).unwrap();
        let messages = read_all(&output).unwrap();
        assert!(
            messages.iter().all(|message| original.contains(message)),
            "byte {position}"
        );
        fs::remove_dir_all(&output).unwrap();
    }
}

/// Files of random bytes and of random pieces of a bag end, and give no others than its messages.
#[test]
fn random_pieces() {
    let folder = folder();
    let [bag, output] = ["run", "new"].map(|name| folder.path().join(name));
    let original = write_bag(&bag, Compression::Zstd, 1);
    let file = bag.join("run_0.mcap");
    let bytes = fs::read(&file).unwrap();
    let mut recovered = 0;
    for seed in 0..300 {
        // With the definitions, without which no message is readable.
        let mut pieces = bytes[..chunks(&bytes)[0].end].to_vec();
        for piece in 0..6 {
            let [start, length] =
                [0, 1].map(|number| random(seed * 100 + piece * 2 + number) as usize);
            let start = start % bytes.len();
            pieces.extend_from_slice(&bytes[start..(start + length % 2000).min(bytes.len())]);
        }
        fs::write(&file, &pieces).unwrap();
        let recovery = match recover(&bag, &output) {
            Err(RecoverError::Nothing { .. }) => continue,
            recovery => recovery.unwrap(),
        };
        recovered += 1;
        // The end of the file may lie within what was a chunk.
        let kept: BTreeSet<_> = original
            .iter()
            .map(|message| (message.sequence, &message.data))
            .collect();
        let messages = read_all(&output).unwrap();
        let strange = messages
            .iter()
            .filter(|message| !kept.contains(&(message.sequence, &message.data)));
        assert!(strange.count() as u64 <= recovery.unverified, "seed {seed}");
        fs::remove_dir_all(&output).unwrap();
    }
    assert!(recovered > 100, "{recovered}");
}

#[test]
fn a_split_bag_whose_last_files_are_cut_or_empty() {
    let folder = folder();
    let [bag, output] = ["run", "new"].map(|name| folder.path().join(name));
    let original = write_bag(&bag, Compression::Zstd, 12);
    fs::remove_file(bag.join("metadata.yaml")).unwrap();
    fs::write(bag.join("run_11.mcap"), b"").unwrap();
    let cut = bag.join("run_10.mcap");
    let bytes = fs::read(&cut).unwrap();
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let recovery = recover(&bag, &output).unwrap();
    let kept: Vec<_> = recovery.files.iter().map(|file| file.kept).collect();
    assert_eq!(
        kept,
        [vec![true; 11], vec![false]].concat(),
        "in their order"
    );
    let messages = read_all(&output).unwrap();
    assert!(messages.len() >= 10 * 14 && messages == original[..messages.len()]);
    assert_eq!(count(&recovery), messages.len() as u64);
    assert_eq!(mcap_files(&output).len(), 11);
    assert_eq!(
        BagReader::open(&output).unwrap().custom()["recovered"],
        "true"
    );
}

#[test]
fn bags_without_anything_readable() {
    let folder = folder();
    let bag = folder.path().join("run");
    fs::create_dir(&bag).unwrap();
    let attempt = |name: &str| recover(&bag, &folder.path().join(name));
    // The recorder had not even made its file.
    let error = attempt("none").unwrap_err();
    assert!(
        matches!(error, RecoverError::Bag(BagError::Invalid(..))),
        "{error}"
    );
    fs::write(bag.join("run_0.mcap"), b"").unwrap();
    let error = attempt("empty").unwrap_err();
    assert!(matches!(error, RecoverError::Nothing { .. }), "{error}");
    fs::write(bag.join("run_0.mcap"), b"[package]\nname = \"lgvi_bag\"\n").unwrap();
    let error = attempt("text").unwrap_err();
    let what = "it starts with [5b, 70,";
    assert!(error.to_string().contains(what), "{error}");
    fs::remove_file(bag.join("run_0.mcap")).unwrap();
    fs::write(bag.join("notes.txt"), b"").unwrap();
    let error = attempt("no_bag").unwrap_err();
    assert!(
        matches!(error, RecoverError::Bag(BagError::Invalid(..))),
        "{error}"
    );
    let database = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n";
    fs::write(bag.join("metadata.yaml"), database).unwrap();
    let error = attempt("sqlite3").unwrap_err();
    assert!(error.to_string().contains("ros2 bag convert"), "{error}");
    assert!(recover(&folder.path().join("missing"), &folder.path().join("x")).is_err());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// What attempts leave that are killed hinders none that follow.
#[test]
fn what_earlier_attempts_left_is_no_hindrance() {
    let folder = folder();
    let [bag, output] = ["run", "new"].map(|name| folder.path().join(name));
    let original = write_bag(&bag, Compression::Zstd, 1);
    for left in ["new.partial", "run/.recovering0"] {
        let left = folder.path().join(left);
        fs::create_dir(&left).unwrap();
        fs::write(left.join("run_0.mcap"), b"no bag").unwrap();
    }
    recover(&bag, &output).unwrap();
    recover_in_place(&bag).unwrap();
    for bag in [bag, output] {
        assert_eq!(read_all(&bag).unwrap(), original);
    }
}

#[test]
fn in_place_keeps_what_was_damaged() {
    let folder = folder();
    let bag = folder.path().join("run");
    let original = write_bag(&bag, Compression::Zstd, 3);
    let names = || {
        let entries = fs::read_dir(&bag).unwrap().flatten();
        let names = entries.map(|entry| entry.file_name().into_string().unwrap());
        names.collect::<BTreeSet<_>>()
    };
    let intact = names();
    recover_in_place(&bag).unwrap();
    assert_eq!(names(), intact);
    assert_eq!(read_all(&bag).unwrap(), original);

    // Only the tail is missing: nothing is lost with it.
    let last = bag.join("run_2.mcap");
    let bytes = fs::read(&last).unwrap();
    fs::write(&last, &bytes[..bytes.len() - 30]).unwrap();
    assert!(recover_in_place(&bag).unwrap().is_whole());
    assert_eq!(names(), intact);
    assert_eq!(read_all(&bag).unwrap(), original);

    let middle = bag.join("run_1.mcap");
    let mut bytes = fs::read(&middle).unwrap();
    let at = bytes.windows(4).position(|four| four == b"zstd").unwrap() + 50;
    bytes[at] ^= 1;
    fs::write(&middle, &bytes).unwrap();
    let recovery = recover_in_place(&bag).unwrap();
    assert!(!recovery.is_whole());
    // All messages of the file were in one chunk.
    let mut expected = intact;
    expected.remove("run_1.mcap");
    expected.insert("run_1.mcap.damaged".to_owned());
    assert_eq!(names(), expected);
    assert_eq!(fs::read(bag.join("run_1.mcap.damaged")).unwrap(), bytes);
    assert_eq!(read_all(&bag).unwrap().len() as u64, count(&recovery));
}

#[test]
fn a_bag_that_is_being_written_is_refused() {
    let folder = folder();
    let [bag, output] = ["run", "new"].map(|name| folder.path().join(name));
    let mut writer = BagWriter::create(&bag, BagOptions::default()).unwrap();
    let often = writer.add_topic(&topic("/often", Qos::default())).unwrap();
    for file in ["run_0.mcap", "run_1.mcap"] {
        for error in [
            recover(&bag, &output).unwrap_err(),
            recover(&bag.join(file), &output).unwrap_err(),
            recover_in_place(&bag).unwrap_err(),
        ] {
            assert!(
                matches!(&error, RecoverError::BeingWritten(open) if *open == bag.join(file)),
                "{error}"
            );
        }
        assert_eq!(fs::read_dir(&bag).unwrap().count(), mcap_files(&bag).len());
        if file == "run_0.mcap" {
            writer.write(often, 1, 1, 0, &payload(0)).unwrap();
            writer.split().unwrap();
            // The next file is made with its first message.
            writer.write(often, 2, 2, 1, &payload(1)).unwrap();
            writer.flush().unwrap();
        }
    }
    // As a recorder that is killed.
    drop(writer);
    recover(&bag, &output).unwrap();
}
