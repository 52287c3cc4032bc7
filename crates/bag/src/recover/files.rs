//! The files of a damaged bag.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use super::{RecoverError, source::Source};
use crate::{
    BagError, METADATA_FILE,
    metadata::{Metadata, within},
    read::{mcap_files, natural, refuse_other, siblings},
};

/// A damaged bag.
pub(super) struct Damaged {
    /// Directory of its files.
    pub directory: PathBuf,
    /// Its MCAP files in their order, relative to the directory.
    pub files: Vec<PathBuf>,
    /// Number of messages in files by `metadata.yaml` or by other files, repeated ones included.
    pub messages: BTreeMap<PathBuf, u64>,
    /// `metadata.yaml`, or the reason why it cannot be used.
    pub metadata: Result<Metadata, String>,
}

/// Finds the files of a bag's directory, or takes a single file.
pub(super) fn find(bag: &Path) -> Result<Damaged, RecoverError> {
    let read_error = RecoverError::read(bag);
    if !fs::metadata(bag).map_err(&read_error)?.is_dir() {
        refuse_other_storages(bag)?;
        return Ok(Damaged {
            directory: bag.parent().unwrap_or(Path::new("")).to_owned(),
            files: bag.file_name().into_iter().map(PathBuf::from).collect(),
            messages: BTreeMap::new(),
            metadata: Err("a single file has none".to_owned()),
        });
    }
    let metadata = read_metadata(&bag.join(METADATA_FILE))?;
    let mut messages = BTreeMap::new();
    let mut files = Vec::new();
    let mut known = BTreeSet::new();
    if let Ok(metadata) = &metadata {
        for listed in &metadata.relative_file_paths {
            let within = within(listed, metadata.version);
            files.extend(within.filter(|name| known.insert(name.clone())));
        }
        messages.extend(metadata.file_counts());
    }
    let mut found = present(bag)?;
    if files.is_empty() {
        let paths: Vec<_> = found.iter().map(|name| bag.join(name)).collect();
        let mut present: BTreeSet<_> = found.iter().cloned().collect();
        for (name, count) in siblings(&paths) {
            if present.insert(name.clone()) {
                found.push(name.clone());
            }
            messages.extend(count.map(|count| (name, count)));
        }
        found.sort_by(|a, b| {
            let [a, b] = [a, b].map(|name| name.as_os_str().as_encoded_bytes());
            natural(a, b).then(a.cmp(b))
        });
    }
    // Files that `metadata.yaml` does not list were begun after it was written.
    found.retain(|name| !known.contains(name));
    files.extend(found);
    if !files.iter().any(|name| bag.join(name).exists()) {
        return Err(RecoverError::NoBag {
            path: bag.to_owned(),
        });
    }
    // Of a bag that is being recorded, only the last file is open. It is refused before anything is made.
    let last = files.last().map(|last| bag.join(last));
    if let Some(last) = last.filter(|last| last.exists()) {
        Source::open(&last)?;
    }
    Ok(Damaged {
        directory: bag.to_owned(),
        files,
        messages,
        metadata,
    })
}

/// Reads `metadata.yaml`. Returns an inner error if it cannot be used, and an outer one if the bag cannot be recovered.
fn read_metadata(file: &Path) -> Result<Result<Metadata, String>, RecoverError> {
    match Metadata::read(file) {
        Ok(metadata) if metadata.compression_mode.eq_ignore_ascii_case("file") => {
            Err(RecoverError::Kind(BagError::Compressed {
                file: file.to_owned(),
                mode: metadata.compression_mode,
                format: metadata.compression_format,
            }))
        }
        Ok(metadata) => Ok(Ok(metadata)),
        Err(error @ (BagError::Storage { .. } | BagError::Compressed { .. })) => {
            Err(RecoverError::Kind(error))
        }
        Err(error) => Ok(Err(error.to_string())),
    }
}

/// The MCAP files in a directory, in the natural order of their names.
fn present(bag: &Path) -> Result<Vec<PathBuf>, RecoverError> {
    let paths = match mcap_files(bag) {
        Ok(paths) => paths,
        Err(BagError::NoBag { .. }) => Vec::new(),
        Err(BagError::Io { path, source }) => return Err(RecoverError::Read { path, source }),
        Err(other) => return Err(RecoverError::Kind(other)),
    };
    let files = paths
        .iter()
        .filter(|path| path.extension().is_some_and(|ending| ending == "mcap") && !path.is_dir());
    Ok(files
        .filter_map(|path| path.file_name())
        .map(PathBuf::from)
        .collect())
}

fn refuse_other_storages(file: &Path) -> Result<(), RecoverError> {
    let start = Source::open(file)?.bytes(0, 16)?;
    refuse_other(file, &start).map_err(RecoverError::Kind)
}
