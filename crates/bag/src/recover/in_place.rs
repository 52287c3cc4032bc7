use std::{
    fs, io,
    path::{Path, PathBuf},
};

use super::{Damaged, Recovery};
use crate::{METADATA_FILE, RecoverError, new_directory::part};

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
    let damaged = Damaged::find(bag)?;
    let unfinished = part(bag, UNFINISHED.into())?;
    let (mut recovery, mut new) = damaged.copy(bag, unfinished.path())?;
    new.push(unfinished.path().join(METADATA_FILE));
    replace(bag, unfinished.path(), &new, &recovery)?;
    recovery.bag = bag.to_owned();
    Ok(recovery)
}

fn replace(
    bag: &Path,
    unfinished: &Path,
    new: &[PathBuf],
    recovery: &Recovery,
) -> Result<(), RecoverError> {
    let old = || recovery.files.iter().filter(|file| file.bytes.is_some());
    for file in old() {
        if file.left_out_places > 0 || !file.kept {
            keep(&file.path)?;
        }
    }
    let metadata = bag.join(METADATA_FILE);
    if recovery.metadata_rebuilt.is_some() && metadata.exists() {
        keep(&metadata)?;
    }
    for path in new {
        let synced = fs::File::open(path).and_then(|file| file.sync_all());
        synced.map_err(RecoverError::write(path))?;
    }
    let mut replaced = Vec::new();
    for path in new {
        let place = bag.join(path.strip_prefix(unfinished).unwrap_or(path));
        if let Some(folder) = place.parent() {
            fs::create_dir_all(folder).map_err(RecoverError::write(folder))?;
        }
        fs::rename(path, &place).map_err(RecoverError::write(&place))?;
        replaced.push(place);
    }
    for file in old().filter(|file| !replaced.contains(&file.path)) {
        fs::remove_file(&file.path).map_err(RecoverError::write(&file.path))?;
    }
    Ok(())
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
