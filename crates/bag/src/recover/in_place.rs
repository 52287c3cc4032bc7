use std::{
    fs, io,
    path::{Path, PathBuf},
};

use super::{RecoverError, Recovery, files, new_bag};
use crate::{METADATA_FILE, new_directory::Part};

/// Where the new files are made.
const UNFINISHED: &str = ".recovering";

/// Added to the names of damaged files that are kept.
const DAMAGED: &str = "damaged";

/// Recovers a bag's directory, as [`recover`](super::recover) does, and puts the new files into the place of the old ones.
///
/// Nothing is replaced before all new files are complete and on the disk; each is then replaced at once, `metadata.yaml`
/// last. The old files of which something was left out are kept as `<name>.damaged`.
///
/// # Errors
/// As [`recover`](super::recover); the bag is then as it was. A bag that is a single file is refused.
pub fn recover_in_place(bag: &Path) -> Result<Recovery, RecoverError> {
    let damaged = files::find(bag)?;
    let unfinished = Part::take(bag.join(UNFINISHED))?;
    let mut recovery = new_bag::make(bag, damaged, &unfinished.path)?;
    replace(bag, &unfinished, &recovery)?;
    recovery.bag = bag.to_owned();
    Ok(recovery)
}

fn replace(bag: &Path, unfinished: &Part, recovery: &Recovery) -> Result<(), RecoverError> {
    for file in &recovery.files {
        if file.bytes.is_some() && (file.left_out_places > 0 || !file.kept) {
            keep(&file.path)?;
        }
    }
    let metadata = bag.join(METADATA_FILE);
    if recovery.metadata_rebuilt.is_some() && metadata.exists() {
        keep(&metadata)?;
    }
    let new = unfinished.tree()?;
    for name in &new {
        let path = unfinished.path.join(name);
        let synced = fs::File::open(&path).and_then(|file| file.sync_all());
        synced.map_err(RecoverError::write(&path))?;
    }
    for name in new {
        let path = bag.join(&name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(RecoverError::write(folder))?;
        }
        fs::rename(unfinished.path.join(&name), &path).map_err(RecoverError::write(&path))?;
    }
    for file in &recovery.files {
        if file.bytes.is_some() && !file.kept && !is_new(recovery, &file.path) {
            fs::remove_file(&file.path).map_err(RecoverError::write(&file.path))?;
        }
    }
    Ok(())
}

/// Whether a file that was dropped has been replaced by one of the same name: a bag has at least one.
fn is_new(recovery: &Recovery, path: &Path) -> bool {
    recovery.files.iter().all(|file| !file.kept)
        && recovery.files.first().is_some_and(|file| file.path == path)
}

/// Gives a damaged file a second name, under which it stays.
fn keep(path: &Path) -> Result<(), RecoverError> {
    let name = path.file_name().unwrap_or_default().display();
    for number in 0_u32.. {
        let kept: PathBuf = path.with_file_name(match number {
            0 => format!("{name}.{DAMAGED}"),
            number => format!("{name}.{DAMAGED}.{number}"),
        });
        match fs::hard_link(path, &kept) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            outcome => return outcome.map_err(RecoverError::write(&kept)),
        }
    }
    Ok(())
}
