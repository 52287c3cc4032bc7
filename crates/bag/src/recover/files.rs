//! The files of a damaged bag.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, TryLockError},
    path::{Path, PathBuf},
};

use super::RecoverError;
use crate::{
    BagError, METADATA_FILE,
    metadata::{COMPRESSION, Metadata, within},
    read::{Source, gaps, mcap_files, natural, refuse_other},
};

/// A damaged bag.
pub(super) struct Damaged {
    /// Directory of its files.
    pub directory: PathBuf,
    /// Its MCAP files in their order, relative to the directory.
    pub files: Vec<PathBuf>,
    /// Number of messages in files by `metadata.yaml`, repeated ones included.
    pub messages: BTreeMap<PathBuf, u64>,
    /// `metadata.yaml`, or the reason why it cannot be used.
    pub metadata: Result<Metadata, String>,
}

/// Finds the files of a bag's directory, or takes a single file. No file of it may be open in a writer of this crate.
pub(super) fn find(bag: &Path) -> Result<Damaged, RecoverError> {
    if !fs::metadata(bag).map_err(BagError::io(bag))?.is_dir() {
        let source = open(bag)?;
        refuse_other(bag, &source.bytes(0, 16)?)?;
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
    if let Ok(metadata) = &metadata {
        let listed = metadata.relative_file_paths.iter();
        files.extend(listed.filter_map(|listed| within(listed, metadata.version)));
        messages.extend(metadata.file_counts());
    }
    let mut others = match mcap_files(bag) {
        Err(BagError::NoBag { .. }) => Vec::new(),
        found => found?,
    };
    others.retain(|file| file.extension().is_some_and(|it| it == "mcap") && !file.is_dir());
    let mut others: Vec<PathBuf> = others
        .iter()
        .filter_map(|file| file.file_name())
        .map(PathBuf::from)
        .collect();
    if files.is_empty() {
        others.extend(gaps(&others));
        others.sort_by(|a, b| natural(a, b));
    }
    // Files that `metadata.yaml` does not list were begun after it was written.
    files.extend(others);
    let mut known = BTreeSet::new();
    files.retain(|name| known.insert(name.clone()));
    let there = || {
        files
            .iter()
            .map(|name| bag.join(name))
            .filter(|path| path.exists())
    };
    if there().next().is_none() {
        return Err(RecoverError::Bag(BagError::NoBag {
            path: bag.to_owned(),
        }));
    }
    // A bag that is being recorded is refused before anything is made.
    for path in there() {
        open(&path)?;
    }
    Ok(Damaged {
        directory: bag.to_owned(),
        files,
        messages,
        metadata,
    })
}

/// Opens a file that no writer of this crate has open.
pub(super) fn open(path: &Path) -> Result<Source, RecoverError> {
    let source = Source::open_damaged(path)?;
    // Writers of this crate hold a lock. A file system without locks cannot tell.
    match source.try_lock_shared() {
        Err(TryLockError::WouldBlock) => Err(RecoverError::BeingWritten {
            file: path.to_owned(),
        }),
        _ => Ok(source),
    }
}

/// Reads `metadata.yaml`. Returns an inner error if it cannot be used, and an outer one if the bag cannot be recovered.
fn read_metadata(file: &Path) -> Result<Result<Metadata, String>, BagError> {
    match Metadata::read(file) {
        Ok(metadata) if metadata.compression_mode.eq_ignore_ascii_case("file") => {
            Err(metadata.compressed(file))
        }
        Err(error @ BagError::Storage { .. }) => Err(error),
        Err(
            error @ BagError::Unexpected {
                field: COMPRESSION, ..
            },
        ) => Err(error),
        metadata => Ok(metadata.map_err(|error| error.to_string())),
    }
}
