//! Damaged bags: whatever is made of one must be a good bag.

use std::{collections::BTreeMap, fs, path::Path};

use lgvi_bag::{BagReader, RecoverError, recover};

use super::{file_of_records, scratch};

/// The bytes are a damaged MCAP file if they begin as one, else records of which one is made: see [`file_of_records`].
pub fn bag_recover(data: &[u8]) {
    let directory = scratch();
    let file = directory.path().join("bag_0.mcap");
    let written = match data.first() {
        Some(0x89) => fs::write(&file, data),
        _ => fs::write(&file, file_of_records(data)),
    };
    if written.is_ok() {
        recovered(&file, &directory.path().join("recovered"));
    }
}

/// Recovers a bag, and reads all of what comes of that.
pub fn recovered(damaged: &Path, output: &Path) {
    let recovery = match recover(damaged, output) {
        Ok(recovery) => recovery,
        Err(error @ RecoverError::Write(_)) => panic!("{error}"),
        Err(error) => return drop(error.to_string()),
    };
    let bag = match BagReader::open(output) {
        Ok(bag) => bag,
        Err(error) => panic!("a recovered bag that is refused: {error}"),
    };
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    for message in bag.messages() {
        match message {
            Ok(message) => *counts.entry(message.topic.name.clone()).or_default() += 1,
            Err(error) => panic!("a recovered bag that is damaged: {error}"),
        }
    }
    let told = recovery
        .messages
        .into_iter()
        .filter(|(_, count)| *count > 0);
    assert_eq!(counts, told.collect());
}
