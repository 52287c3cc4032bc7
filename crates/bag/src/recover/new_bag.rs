//! The recovered bag.

use std::{collections::BTreeMap, path::Path};

use super::{
    RecoverError, RecoveredFile, Recovery, copy,
    files::{self, Damaged},
    head::Known,
};
use crate::{BagOptions, BagWriter, Compression, Topic, metadata::Metadata, times::sum};

/// Entry of the custom data of every recovered bag.
const RECOVERED: &str = "recovered";

/// Entry of the custom data with the number of missing messages, to which further recoveries add.
const MISSING: &str = "missing";

/// The recovered bag.
pub(super) struct NewBag<'a> {
    pub directory: &'a Path,
    /// `None` before the first message.
    pub writer: Option<BagWriter>,
    /// Topics without messages that are not in it yet.
    pub silent: Vec<Topic>,
    pub known: Known,
    /// Hash of each topic's type by name and type, by `metadata.yaml`.
    pub hashes: BTreeMap<(&'a str, &'a str), &'a str>,
    /// Number of messages that no checksum covers.
    pub unverified: u64,
    /// The last custom data that a file holds.
    pub custom: BTreeMap<String, String>,
}

impl NewBag<'_> {
    /// The writer, after it was begun with this file if there was none.
    pub fn open(
        &mut self,
        name: &Path,
        compression: Compression,
    ) -> Result<&mut BagWriter, RecoverError> {
        let none = match &mut self.writer {
            Some(writer) => return Ok(writer),
            none => none,
        };
        let options = BagOptions {
            compression,
            ..BagOptions::default()
        };
        let name = name.display().to_string();
        Ok(none.insert(BagWriter::open(
            self.directory,
            "recovered",
            name,
            options,
            false,
        )?))
    }

    /// Adds the topics without messages, where there is a file for them.
    pub fn add_silent(&mut self) -> Result<(), RecoverError> {
        let Some(writer) = &mut self.writer else {
            return Ok(());
        };
        for topic in self.silent.drain(..) {
            match writer.add_topic(&topic) {
                Err(error) if writer.is_ended() => return Err(error.into()),
                _ => {}
            }
        }
        Ok(())
    }
}

/// Makes a bag in the directory `output`.
pub(super) fn make(bag: &Path, damaged: Damaged, output: &Path) -> Result<Recovery, RecoverError> {
    let mut new = NewBag {
        directory: output,
        writer: None,
        silent: Vec::new(),
        known: Known::default(),
        hashes: damaged
            .metadata
            .as_ref()
            .map_or_else(|_| BTreeMap::new(), Metadata::type_hashes),
        unverified: 0,
        custom: BTreeMap::new(),
    };
    let mut files = Vec::new();
    let mut is_counted = false;
    for name in &damaged.files {
        let path = damaged.directory.join(name);
        let mut file = if path.exists() {
            copy::copy(&files::open(&path)?, name, &mut new)?
        } else {
            RecoveredFile {
                path,
                ..RecoveredFile::default()
            }
        };
        let claimed = file.missing.max(damaged.messages.get(name).copied());
        is_counted |= claimed.is_some();
        file.missing = claimed.map(|claimed| claimed.saturating_sub(file.messages));
        files.push(file);
    }
    let lost = sum(files.iter().filter_map(|file| file.missing));
    let found = sum(files.iter().map(|file| file.messages));
    let metadata = damaged.metadata.as_ref().ok();
    let total = metadata.map(|metadata| metadata.message_count.saturating_sub(found));
    let missing = Some(lost).filter(|_| is_counted).max(total);
    if found == 0 {
        check_empty(bag, &files, missing)?;
    }
    // A bag has at least one file.
    new.open(&damaged.files[0], Compression::default())?;
    new.add_silent()?;
    let NewBag {
        writer: Some(writer),
        unverified,
        custom,
        ..
    } = new
    else {
        return Ok(Recovery::default());
    };
    let metadata_rebuilt = damaged.metadata.as_ref().err().cloned();
    let mut custom = damaged.metadata.map_or(custom, Metadata::into_custom);
    custom.insert(RECOVERED.to_owned(), "true".to_owned());
    if let Some(missing @ 1..) = missing {
        let before = custom.get(MISSING).and_then(|count| count.parse().ok());
        let all = missing.saturating_add(before.unwrap_or(0));
        custom.insert(MISSING.to_owned(), all.to_string());
    }
    let summary = writer.finish(custom)?;
    Ok(Recovery {
        bag: output.to_owned(),
        messages: summary.messages,
        repeated: summary.repeated,
        missing,
        times: summary.times,
        unverified,
        metadata_rebuilt,
        files,
    })
}

/// Checks that a bag of which no messages are left had none.
fn check_empty(
    bag: &Path,
    files: &[RecoveredFile],
    missing: Option<u64>,
) -> Result<(), RecoverError> {
    let had_none = match missing {
        Some(missing) => missing == 0,
        None => files.iter().all(RecoveredFile::is_sound),
    };
    if had_none {
        return Ok(());
    }
    let mut left_out = files.iter().flat_map(|file| &file.left_out);
    Err(RecoverError::Nothing {
        bag: bag.to_owned(),
        bytes: files.iter().filter_map(|file| file.bytes).sum(),
        missing,
        reason: left_out.next().map(|place| place.reason.clone()),
    })
}
