//! Directories that are complete or not there.

use std::{
    ffi::OsString,
    fs::{self, File, TryLockError},
    io::{self, ErrorKind},
    path::{Path, PathBuf},
};

use crate::{METADATA_FILE, WriteError};

/// Where a directory is filled: added to its name, or a directory in it.
const PART: &str = ".part";

/// A file in a directory that is being filled, locked by who does that.
const MARK: &str = ".unfinished";

/// A directory that is filled under another name, and has its own when it is complete: `<output>.part` beside it, or
/// `.part` in it if it is there already. One that is dropped before leaves nothing behind.
pub struct NewDirectory {
    output: PathBuf,
    exists: bool,
    part: Part,
}

impl NewDirectory {
    /// Begins to make the directory `output`, which must not exist, or be empty. What an earlier attempt left, that was
    /// ended before it was complete, is removed.
    ///
    /// # Errors
    /// There is something at `output` or where it is filled, it has no name, or it cannot be written.
    pub fn begin(output: &Path) -> Result<Self, WriteError> {
        let exists = exists_empty(output)?;
        let part = if exists {
            output.join(PART)
        } else {
            let mut name = output
                .file_name()
                .ok_or_else(|| WriteError::NoName {
                    path: output.to_owned(),
                })?
                .to_owned();
            name.push(PART);
            let part = output.with_file_name(name);
            if let Some(parent) = part.parent() {
                fs::create_dir_all(parent).map_err(WriteError::io(parent))?;
            }
            part
        };
        Ok(Self {
            output: output.to_owned(),
            exists,
            part: Part::take(part)?,
        })
    }

    /// Where its files are written.
    pub fn path(&self) -> &Path {
        &self.part.path
    }

    /// Gives it its name.
    ///
    /// # Errors
    /// That is taken by now, or the directory cannot be renamed.
    pub fn complete(mut self) -> Result<(), WriteError> {
        let output = &self.output;
        if self.exists {
            exists_empty(output)?;
            for name in self.part.files()? {
                let path = output.join(&name);
                fs::rename(self.part.path.join(name), &path).map_err(WriteError::io(&path))?;
            }
            return Ok(());
        }
        match fs::rename(&self.part.path, output) {
            Ok(()) => {}
            Err(error) if error.kind() == ErrorKind::DirectoryNotEmpty => {
                return Err(taken(output));
            }
            Err(error) => return Err(WriteError::io(output)(error)),
        }
        self.part.path.clone_from(output);
        self.part.renamed = true;
        let mark = output.join(MARK);
        fs::remove_file(&mark).map_err(WriteError::io(&mark))
    }
}

/// A directory that is being filled, and is removed in the end.
pub(crate) struct Part {
    pub path: PathBuf,
    renamed: bool,
    _lock: File,
}

impl Part {
    /// Makes the directory, or takes and empties one that was left. One that others made is left alone.
    pub fn take(path: PathBuf) -> Result<Self, WriteError> {
        let mark = path.join(MARK);
        match fs::create_dir(&path) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => {
                return Err(WriteError::io(&path)(error));
            }
            Err(_) if !mark.exists() && !names(&path)?.is_empty() => return Err(taken(&path)),
            _ => {}
        }
        let lock = File::create(&mark).map_err(WriteError::io(&mark))?;
        // File systems without locks do without.
        if let Err(TryLockError::WouldBlock) = lock.try_lock() {
            let busy = io::Error::new(ErrorKind::ResourceBusy, "is being written by another");
            return Err(WriteError::io(&path)(busy));
        }
        let part = Self {
            path,
            renamed: false,
            _lock: lock,
        };
        for name in part.files()? {
            let left = part.path.join(name);
            let removed = if left.is_dir() {
                fs::remove_dir_all(&left)
            } else {
                fs::remove_file(&left)
            };
            removed.map_err(WriteError::io(&left))?;
        }
        Ok(part)
    }

    /// The files in it and in its directories, relative to it; one that describes the others is the last.
    pub fn tree(&self) -> Result<Vec<PathBuf>, WriteError> {
        let mut files = Vec::new();
        let mut left: Vec<_> = self.files()?.into_iter().map(PathBuf::from).rev().collect();
        while let Some(name) = left.pop() {
            let path = self.path.join(&name);
            if path.is_dir() {
                left.extend(names(&path)?.into_iter().map(|inner| name.join(inner)));
            } else {
                files.push(name);
            }
        }
        Ok(files)
    }

    /// Names of what is in it; one that describes the others is the last.
    pub fn files(&self) -> Result<Vec<OsString>, WriteError> {
        let mut names = names(&self.path)?;
        names.retain(|name| name != MARK);
        names.sort_by_key(|name| name == METADATA_FILE);
        Ok(names)
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        if !self.renamed {
            // What is in it is of no use; whatever made it incomplete is told already.
            let _ = fs::remove_dir_all(&self.path);
        }
    }
}

/// Makes the directory, or takes an empty one; whether it was made.
pub(crate) fn make_empty(path: &Path) -> Result<bool, WriteError> {
    let exists = exists_empty(path)?;
    if !exists {
        fs::create_dir_all(path).map_err(WriteError::io(path))?;
    }
    Ok(!exists)
}

/// Whether there is a directory. It has to be empty, but for one that is being filled.
fn exists_empty(path: &Path) -> Result<bool, WriteError> {
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(WriteError::io(path)(error)),
        Ok(_) if names(path)?.iter().all(|name| name == PART) => Ok(true),
        Ok(_) => Err(taken(path)),
    }
}

fn names(directory: &Path) -> Result<Vec<OsString>, WriteError> {
    let read = || -> io::Result<_> {
        let entries = fs::read_dir(directory)?;
        entries.map(|entry| Ok(entry?.file_name())).collect()
    };
    read().map_err(|error| match error.kind() {
        ErrorKind::NotADirectory | ErrorKind::NotFound => taken(directory),
        _ => WriteError::io(directory)(error),
    })
}

fn taken(path: &Path) -> WriteError {
    WriteError::Exists {
        path: path.to_owned(),
    }
}
