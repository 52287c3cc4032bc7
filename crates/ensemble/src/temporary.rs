//! Temporary files and directories for incomplete output.

use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::Path;

use tempfile::{Builder, NamedTempFile, TempDir};

const PART: &str = ".samples_";
const FOLDER: &str = ".merge_";
const SUFFIX: &str = ".tmp";

/// Creates a file beside the parts. It is locked while it is written, so that other runs do not [tidy](tidy) it away.
pub(crate) fn file(directory: &Path) -> io::Result<NamedTempFile> {
    loop {
        let file = builder(PART, 0o666).tempfile_in(directory)?;
        // On a file system without locks, no run removes temporary files.
        let _ = file.as_file().try_lock();
        // Another run may have removed the file before it was locked.
        if file.path().try_exists()? {
            return Ok(file);
        }
    }
}

/// Creates a temporary directory in `parent`.
pub(crate) fn directory(parent: &Path) -> io::Result<TempDir> {
    builder(FOLDER, 0o777).tempdir_in(parent)
}

/// Removes the files that killed writers have left behind. Their locks are free.
pub(crate) fn tidy(directory: &Path) -> io::Result<()> {
    for entry in directory.read_dir()? {
        let entry = entry?;
        let name = entry.file_name();
        let temporary = name
            .to_str()
            .is_some_and(|name| name.starts_with(PART) && name.ends_with(SUFFIX));
        if temporary {
            match tidy_one(&entry.path()) {
                // The file has become a part, or belongs to another user.
                Err(error)
                    if [ErrorKind::NotFound, ErrorKind::PermissionDenied]
                        .contains(&error.kind()) => {}
                tidied => tidied?,
            }
        }
    }
    Ok(())
}

fn tidy_one(path: &Path) -> io::Result<()> {
    let file = File::options().append(true).open(path)?;
    match file.try_lock() {
        Ok(()) => std::fs::remove_file(path),
        Err(TryLockError::WouldBlock | TryLockError::Error(_)) => Ok(()),
    }
}

/// Returns a builder with these permissions, subject to the umask.
fn builder(prefix: &'static str, mode: u32) -> Builder<'static, 'static> {
    let mut builder = Builder::new();
    builder.prefix(prefix).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = mode;
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_nobody_writes_to_is_tidied() {
        let temporary = TempDir::new().unwrap();
        let directory = temporary.path();
        let written = file(directory).unwrap();
        let left = directory.join(".samples_left.tmp");
        let other = directory.join(".other.tmp");
        for path in [&left, &other] {
            std::fs::write(path, "PAR1").unwrap();
        }
        tidy(directory).unwrap();
        assert!(written.path().exists() && other.exists() && !left.exists());
        let kept = written.into_temp_path().keep().unwrap();
        tidy(directory).unwrap();
        assert!(!kept.exists());
    }
}
