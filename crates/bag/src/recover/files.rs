//! Which files a bag has.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use super::{RecoverError, original::Original, source::Source};
use crate::{
    BagError, METADATA_FILE,
    metadata::within,
    read::{OTHER_STORAGES, mcap_files, natural, siblings},
};

/// A damaged bag.
pub(super) struct Damaged {
    /// Where its files lie.
    pub directory: PathBuf,
    /// Its MCAP files in their order, relative to the directory.
    pub files: Vec<PathBuf>,
    /// Messages of files, repeated ones included, as other files tell them.
    pub told: BTreeMap<PathBuf, u64>,
    /// What `metadata.yaml` says, or why that cannot be used; none for a single file.
    pub original: Option<Result<Original, String>>,
}

/// Finds the files of a bag's directory, or takes a single file.
pub(super) fn find(bag: &Path) -> Result<Damaged, RecoverError> {
    let read_error = RecoverError::read(bag);
    if !fs::metadata(bag).map_err(&read_error)?.is_dir() {
        refuse_other_storages(bag)?;
        return Ok(Damaged {
            directory: bag.parent().unwrap_or(Path::new("")).to_owned(),
            files: bag.file_name().into_iter().map(PathBuf::from).collect(),
            told: BTreeMap::new(),
            original: None,
        });
    }
    let original = Original::read(&bag.join(METADATA_FILE))?;
    let mut files = Vec::new();
    let mut known = BTreeSet::new();
    if let Ok(original) = &original {
        for listed in &original.relative_file_paths {
            let within = within(listed, original.version);
            files.extend(within.filter(|name| known.insert(name.clone())));
        }
    }
    let mut found = present(bag)?;
    let mut told = BTreeMap::new();
    if files.is_empty() {
        let paths: Vec<_> = found.iter().map(|name| bag.join(name)).collect();
        let mut present: BTreeSet<_> = found.iter().cloned().collect();
        for (name, messages) in siblings(&paths) {
            if present.insert(name.clone()) {
                found.push(name.clone());
            }
            told.extend(messages.map(|messages| (name, messages)));
        }
        found.sort_by(|a, b| {
            let [a, b] = [a, b].map(|name| name.as_os_str().as_encoded_bytes());
            natural(a, b).then(a.cmp(b))
        });
    }
    // Those that `metadata.yaml` does not list were begun after it was written.
    found.retain(|name| !known.contains(name));
    files.extend(found);
    if !files.iter().any(|name| bag.join(name).exists()) {
        return Err(RecoverError::NoBag {
            path: bag.to_owned(),
        });
    }
    // Before anything is made of them: of a bag that is being recorded, only the last file is open.
    let last = files.last().map(|last| bag.join(last));
    if let Some(last) = last.filter(|last| last.exists()) {
        Source::open(&last)?;
    }
    Ok(Damaged {
        directory: bag.to_owned(),
        files,
        told,
        original: Some(original),
    })
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
    let (start, known) = Source::open(file)?.peek::<16>(0)?;
    let storage = OTHER_STORAGES
        .iter()
        .find(|(magic, _)| start[..known].starts_with(magic));
    storage.map_or(Ok(()), |(_, found)| {
        Err(RecoverError::Kind(BagError::Storage {
            file: file.to_owned(),
            found: (*found).to_owned(),
        }))
    })
}
