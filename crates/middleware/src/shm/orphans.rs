//! Descriptions of services whose maker was killed before it had written them.
//!
//! iceoryx2 0.10 makes the file of a description first, which only its owner may read and write, writes it, and then takes
//! away the permission to write. The cleaning of dead nodes passes over a file that has not come so far, and nobody can make
//! the service again while it is there.

use std::{
    fs::{self, DirEntry},
    io,
    os::unix::fs::PermissionsExt,
    path::Path,
    time::Duration,
};

/// Where descriptions lie below the directory of shared memory.
const DIRECTORY: &str = "services";

/// The permissions of a description that is being written.
const UNFINISHED: u32 = 0o600;

/// How long nobody takes to write a description of some kilobytes.
const ABANDONED: Duration = Duration::from_secs(20);

/// Removes the unfinished descriptions that nobody has touched for a long time.
pub(super) fn remove(root: &Path) {
    let entries = fs::read_dir(root.join(DIRECTORY)).into_iter().flatten();
    for entry in entries.flatten() {
        if matches!(is_orphan(&entry), Ok(true)) {
            // Another process may have been faster.
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn is_orphan(entry: &DirEntry) -> io::Result<bool> {
    let metadata = entry.metadata()?;
    let age = metadata.modified()?.elapsed().unwrap_or_default();
    let mode = metadata.permissions().mode() & 0o777;
    Ok(metadata.is_file() && mode == UNFINISHED && age > ABANDONED)
}
