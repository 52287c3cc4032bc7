//! The recovered bag.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{
    RecoverError, RecoveredFile, Recovery,
    file::{self, Copied},
    files::Damaged,
    latched::Latched,
    output::Output,
    source::Source,
};
use crate::{
    BagReader, METADATA_FILE, WriteError,
    metadata::{File, Metadata},
};

/// Entry of the custom data of every recovered bag.
const RECOVERED: &str = "recovered";

/// Entry of the custom data with the number of missing messages, to which further recoveries add.
const MISSING: &str = "missing";

/// Makes a bag in the directory `output`.
pub(super) fn make(bag: &Path, damaged: Damaged, output: &Path) -> Result<Recovery, RecoverError> {
    let mut recovery = Recovery {
        bag: output.to_owned(),
        metadata_rebuilt: damaged.metadata.as_ref().err().cloned(),
        ..Recovery::default()
    };
    let mut latched = Latched::default();
    let mut custom = BTreeMap::new();
    let mut names: Vec<PathBuf> = Vec::new();
    let mut is_counted = false;
    for name in &damaged.files {
        let path = damaged.directory.join(name);
        let Copied {
            mut file,
            unverified,
            custom: of_file,
            is_mcap,
        } = if path.exists() {
            file::copy(&path, output.join(name), &mut latched)?
        } else {
            missing_file(path)
        };
        if !is_mcap && damaged.files.len() == 1 && file.bytes > Some(0) {
            let found = Source::open(&file.path)?.bytes(0, mcap::MAGIC.len())?;
            return Err(RecoverError::NotMcap {
                file: file.path,
                found,
            });
        }
        // Here, `missing` is still the number of messages that the file itself claims to hold.
        let claimed = file.missing.max(damaged.messages.get(name).copied());
        is_counted |= claimed.is_some();
        file.missing = claimed.map(|claimed| claimed.saturating_sub(file.messages));
        recovery.unverified += unverified;
        custom = of_file.unwrap_or(custom);
        if file.kept {
            names.push(name.clone());
        }
        recovery.files.push(file);
    }
    let lost = sum(recovery.files.iter().filter_map(|file| file.missing));
    let found = sum(recovery.files.iter().map(|file| file.messages));
    let total = damaged
        .metadata
        .as_ref()
        .ok()
        .map(|metadata| metadata.message_count);
    let total = total.map(|total| total.saturating_sub(found));
    recovery.missing = Some(lost).filter(|_| is_counted).max(total);
    if found == 0 {
        check_empty(bag, &recovery)?;
    }
    if names.is_empty() {
        // A bag has at least one file.
        let name = damaged.files[0].clone();
        Output::new(output.join(&name), &mut latched).finish()?;
        names.push(name);
    }
    describe(output, &names, damaged.metadata.ok(), custom, &mut recovery)?;
    Ok(recovery)
}

fn missing_file(path: PathBuf) -> Copied {
    Copied {
        file: RecoveredFile {
            path,
            ..RecoveredFile::default()
        },
        unverified: 0,
        custom: None,
        is_mcap: false,
    }
}

fn sum(counts: impl Iterator<Item = u64>) -> u64 {
    counts.fold(0, u64::saturating_add)
}

/// Checks that a bag of which no messages are left had none.
fn check_empty(bag: &Path, recovery: &Recovery) -> Result<(), RecoverError> {
    let files = &recovery.files;
    let had_none = match recovery.missing {
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
        missing: recovery.missing,
        reason: left_out.next().map(|place| place.reason.clone()),
    })
}

/// Writes `metadata.yaml` by what the new files hold, and completes the report.
fn describe(
    output: &Path,
    names: &[PathBuf],
    original: Option<Metadata>,
    mut custom: BTreeMap<String, String>,
    recovery: &mut Recovery,
) -> Result<(), RecoverError> {
    let paths = names.iter().map(|name| output.join(name));
    let mut bag = BagReader::open_files(paths.collect()).map_err(RecoverError::Kind)?;
    let mut compression = [String::new(), String::new()];
    let mut distribution = String::new();
    if let Some(original) = original {
        // Messages that rosbag2 has compressed are copied as they are.
        compression = [
            original.compression_format.clone(),
            original.compression_mode.clone(),
        ];
        distribution.clone_from(&original.ros_distro);
        bag.describe(original);
        custom.clone_from(bag.custom());
    }
    custom.insert(RECOVERED.to_owned(), "true".to_owned());
    if let Some(missing @ 1..) = recovery.missing {
        let before = custom.get(MISSING).and_then(|count| count.parse().ok());
        let all = missing.saturating_add(before.unwrap_or(0));
        custom.insert(MISSING.to_owned(), all.to_string());
    }
    let files: Vec<_> = names
        .iter()
        .zip(bag.files())
        .map(|(name, file)| File {
            name: name.display().to_string(),
            times: file.times,
            messages: file.messages.unwrap_or(0),
        })
        .collect();
    let counts = bag.counts_of_topics().unwrap_or_default();
    let topics = bag.topics().iter().zip(counts);
    let mut metadata = Metadata::new(&files, topics, custom).map_err(WriteError::from)?;
    [metadata.compression_format, metadata.compression_mode] = compression;
    if !distribution.is_empty() {
        metadata.ros_distro = distribution;
    }
    let path = output.join(METADATA_FILE);
    metadata.write(&path).map_err(RecoverError::write(&path))?;

    let messages = bag.message_counts().unwrap_or_default().into_iter();
    recovery.messages = messages
        .map(|(topic, count)| (topic.to_owned(), count))
        .collect();
    recovery.repeated = sum(bag.repeats().into_values());
    recovery.times = bag.times();
    Ok(())
}
