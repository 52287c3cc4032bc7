use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use crate::Environment;
use crate::shm::ShmOptions;
use thiserror::Error;

/// A file that one process at a time can hold. It is let go with this value, or with the process, however that ends.
#[derive(Debug)]
pub struct FileLock {
    path: PathBuf,
    _file: File,
}

/// A lock that cannot be taken.
#[derive(Debug, Error)]
pub enum LockError {
    /// Another process has it.
    #[error("held by {0}")]
    Held(String),
    /// The directory of shared memory cannot be used.
    #[error("{0}")]
    Directory(String),
    /// The file cannot be used.
    #[error("cannot lock {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl FileLock {
    /// Takes the lock `name` of the environment's domain; `holder` is what others are told of who holds it.
    ///
    /// It lies in the directory of shared memory: those who share no memory, as other users, do not lock each other out.
    pub fn take(environment: &Environment, name: &str, holder: &str) -> Result<Self, LockError> {
        let options = ShmOptions::from_env(environment);
        let directory = options
            .prepared_root()
            .map_err(|error| LockError::Directory(error.to_string()))?;
        let domain = environment.domain_id;
        Self::take_in(&directory, &format!("lgvi_{name}_{domain}.lock"), holder)
    }

    /// Takes the lock of that name in a directory.
    pub(crate) fn take_in(directory: &Path, name: &str, holder: &str) -> Result<Self, LockError> {
        let path = directory.join(name);
        let fail = |source| LockError::Io {
            path: path.clone(),
            source,
        };
        std::fs::create_dir_all(directory).map_err(fail)?;
        loop {
            let mut file = open(&path).map_err(fail)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let mut other = String::new();
                    // Who it is is good to know, but changes nothing.
                    let _ = file.read_to_string(&mut other);
                    let unknown = other.is_empty();
                    return Err(LockError::Held(if unknown {
                        "an unknown process".into()
                    } else {
                        other
                    }));
                }
                Err(TryLockError::Error(error)) => return Err(fail(error)),
            }
            // Who held it may have removed it after we had opened it.
            if !is_at(&file, &path) {
                continue;
            }
            // For others to read; a file of another user holds what that one has written.
            let _ = file
                .set_len(0)
                .and_then(|()| write!(file, "process {}: {holder}", std::process::id()));
            return Ok(Self { path, _file: file });
        }
    }
}

impl Drop for FileLock {
    fn drop(&mut self) {
        // One that stays, as another user's does, can be locked by the next one too.
        let _ = std::fs::remove_file(&self.path);
    }
}

fn open(path: &Path) -> io::Result<File> {
    let options = || {
        let mut options = OpenOptions::new();
        options.read(true).custom_flags(nix::libc::O_NOFOLLOW);
        options
    };
    match options()
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)
    {
        // Another user's: it can be locked all the same.
        Err(error) if error.kind() == ErrorKind::PermissionDenied => options().open(path),
        opened => opened,
    }
}

/// Whether the file is still the one of this path.
fn is_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), std::fs::symlink_metadata(path)) {
        (Ok(own), Ok(there)) => (own.dev(), own.ino()) == (there.dev(), there.ino()),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_at_a_time_holds_it_and_says_who() {
        let directory = tempfile::tempdir().unwrap();
        let take = || FileLock::take_in(directory.path(), "a.lock", "a flight");
        let first = take().unwrap();
        let error = take().unwrap_err().to_string();
        assert_eq!(
            error,
            format!("held by process {}: a flight", std::process::id())
        );
        drop(first);
        assert_eq!(
            std::fs::read_dir(directory.path()).unwrap().count(),
            0,
            "files are left"
        );
        take().unwrap();
    }
}
