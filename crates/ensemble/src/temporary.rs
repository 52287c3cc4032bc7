//! Files and directories that are not whole yet.

use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::Path;

use tempfile::{Builder, NamedTempFile, TempDir};

const PART: &str = ".samples_";
const FOLDER: &str = ".merge_";
const SUFFIX: &str = ".tmp";

/// A file beside the parts, locked as long as it is written to, so that nobody [tidies](tidy) it away.
pub(crate) fn file(directory: &Path) -> io::Result<NamedTempFile> {
    loop {
        let file = builder(PART, 0o666).tempfile_in(directory)?;
        // Where a file system has no locks nobody tidies.
        let _ = file.as_file().try_lock();
        // Somebody may have tidied before it was locked.
        if file.path().try_exists()? {
            return Ok(file);
        }
    }
}

/// A directory beside others.
pub(crate) fn directory(parent: &Path) -> io::Result<TempDir> {
    builder(FOLDER, 0o777).tempdir_in(parent)
}

/// Removes the files that killed writers have left: those that nobody has locked.
pub(crate) fn tidy(directory: &Path) -> io::Result<()> {
    for entry in directory.read_dir()? {
        let entry = entry?;
        let name = entry.file_name();
        let temporary = name
            .to_str()
            .is_some_and(|name| name.starts_with(PART) && name.ends_with(SUFFIX));
        if temporary {
            match tidy_one(&entry.path()) {
                // It has become a part, or is somebody else's.
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

/// With these permissions as far as the umask leaves them.
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
