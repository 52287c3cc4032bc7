//! A bag that is cut off or has flipped bits gives an error or its messages, never a panic, other messages or a huge
//! allocation.

#![allow(clippy::unwrap_used)]

use crate::{common, largest};

use std::{collections::BTreeMap, fs, path::Path, sync::Mutex};

use common::{Read, payload, random, read_all, topic};
use lgvi_bag::{BagError, BagOptions, BagWriter, Compression, Qos};

/// One test at a time, so that none sees what another allocates.
static ALONE: Mutex<()> = Mutex::new(());

/// The longest record that is believed, and what a growing buffer adds.
const LARGEST_ALLOWED: usize = 2 * (64 << 20);

fn write_bag(directory: &Path, compression: Compression) -> Vec<Read> {
    let mut writer = BagWriter::create(
        directory,
        BagOptions {
            compression,
            ..BagOptions::default()
        },
    )
    .unwrap();
    let id = writer.add_topic(&topic("/a", Qos::default())).unwrap();
    for sequence in 0..300 {
        writer
            .write(id, 5 + u64::from(sequence), 5, sequence, &payload(sequence))
            .unwrap();
        if sequence % 100 == 99 {
            writer.flush().unwrap();
        }
    }
    writer.finish(BTreeMap::new()).unwrap();
    read_all(directory).unwrap()
}

fn check(
    directory: &Path,
    file: &Path,
    damaged: &[u8],
    original: &[Read],
    case: &str,
) -> Result<(), BagError> {
    fs::write(file, damaged).unwrap();
    largest::reset();
    let outcome = read_all(directory);
    let largest = largest::largest();
    assert!(largest <= LARGEST_ALLOWED, "{case}: {largest} bytes");
    let messages = outcome?;
    assert!(messages == original, "{case}: other messages, and no error");
    Ok(())
}

#[test]
fn damaged_bags() {
    let _alone = ALONE.lock();
    for compression in [Compression::None, Compression::Zstd] {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().join("run");
        let original = write_bag(&directory, compression);
        let file = directory.join("run_0.mcap");
        let bytes = fs::read(&file).unwrap();

        for step in 0..200 {
            let length = bytes.len() * step / 200;
            let outcome = check(
                &directory,
                &file,
                &bytes[..length],
                &original,
                &format!("cut to {length}"),
            );
            assert!(
                matches!(&outcome, Err(error) if error.to_string().contains("truncated")),
                "cut to {length}: {outcome:?}"
            );
        }

        // Few flips go unnoticed: those in what is not read (indexes of messages, the library's name, topics and
        // definitions before the first chunk, which are read from the summary).
        let mut noticed = 0;
        for seed in 0..500 {
            let mut damaged = bytes.clone();
            let random = random(seed);
            let position = random as usize % bytes.len();
            damaged[position] ^= 1 << (random >> 61);
            let case = format!("bit {} of byte {position}", random >> 61);
            noticed += usize::from(check(&directory, &file, &damaged, &original, &case).is_err());
        }
        assert!(noticed > 300, "{compression:?}: {noticed}");
        fs::write(&file, &bytes).unwrap();
    }
}

/// Every byte of the sections that hold lengths and offsets, set to what makes lengths absurd.
#[test]
fn absurd_lengths() {
    let _alone = ALONE.lock();
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let original = write_bag(&directory, Compression::Zstd);
    let file = directory.join("run_0.mcap");
    let bytes = fs::read(&file).unwrap();
    let positions = (0..400).chain(bytes.len() - 1500..bytes.len());
    for position in positions {
        for value in [0x00, 0x7f, 0xff] {
            let mut damaged = bytes.clone();
            damaged[position] = value;
            let case = format!("byte {position} = {value:#x}");
            let _ = check(&directory, &file, &damaged, &original, &case);
        }
    }
}

#[test]
fn damaged_metadata() {
    let _alone = ALONE.lock();
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let original = write_bag(&directory, Compression::Zstd);
    let file = directory.join("metadata.yaml");
    let bytes = fs::read(&file).unwrap();
    for length in 0..bytes.len() {
        let case = format!("cut to {length}");
        let _ = check(&directory, &file, &bytes[..length], &original, &case);
    }
    for seed in 0..500 {
        let mut damaged = bytes.clone();
        let random = random(seed);
        damaged[random as usize % bytes.len()] ^= 1 << (random >> 61);
        let _ = check(
            &directory,
            &file,
            &damaged,
            &original,
            &format!("seed {seed}"),
        );
    }
}
