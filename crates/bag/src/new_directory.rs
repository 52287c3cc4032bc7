//! Directories that are complete or not there.

use std::{
    ffi::OsString,
    fs::{self, Permissions},
    io::{self, ErrorKind},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

use tempfile::TempDir;

use crate::{METADATA_FILE, WriteError};

/// Added to the name of a directory while it is filled, before some random letters.
const PART: &str = ".part";

/// A directory that is filled under another name, and has its own when it is complete: `<output>.part…` beside it, or
/// `.part…` in it if it is there already. One that is dropped before leaves nothing behind; one whose process is killed is
/// left to be removed by hand.
pub struct NewDirectory {
    output: PathBuf,
    exists: bool,
    part: TempDir,
}

impl NewDirectory {
    /// Begins to make the directory `output`, which must not exist, or be empty.
    ///
    /// # Errors
    /// There is something at `output`, it has no name, or it cannot be written.
    pub fn begin(output: &Path) -> Result<Self, WriteError> {
        let exists = exists_empty(output)?;
        let part = match output.file_name() {
            _ if exists => part(output, PART.into())?,
            None => return Err(WriteError::NoName(output.to_owned())),
            Some(name) => {
                let parent = match output.parent() {
                    Some(parent) if parent != Path::new("") => parent,
                    _ => Path::new("."),
                };
                fs::create_dir_all(parent).map_err(WriteError::io(parent))?;
                let mut name = name.to_owned();
                name.push(PART);
                part(parent, name)?
            }
        };
        Ok(Self {
            output: output.to_owned(),
            exists,
            part,
        })
    }

    /// Where its files are written.
    pub fn path(&self) -> &Path {
        self.part.path()
    }

    /// Gives it its name.
    ///
    /// # Errors
    /// That is taken by now, or the directory cannot be renamed.
    pub fn complete(self) -> Result<(), WriteError> {
        let (part, output) = (self.part.path(), &self.output);
        if self.exists {
            exists_empty(output)?;
            let mut names = names(part)?;
            // What tells of the files comes last.
            names.sort_by_key(|name| name == METADATA_FILE);
            for name in names {
                let path = output.join(&name);
                fs::rename(part.join(name), &path).map_err(WriteError::io(&path))?;
            }
            return Ok(());
        }
        match fs::rename(part, output) {
            Ok(()) => {
                let _ = self.part.keep();
                Ok(())
            }
            Err(error) if error.kind() == ErrorKind::DirectoryNotEmpty => {
                Err(WriteError::Exists(output.clone()))
            }
            Err(error) => Err(WriteError::io(output)(error)),
        }
    }
}

/// Makes a directory in another one, with random letters behind its name, that is removed when it is dropped.
pub(crate) fn part(parent: &Path, name: OsString) -> Result<TempDir, WriteError> {
    let mut builder = tempfile::Builder::new();
    let builder = builder
        .prefix(&name)
        .permissions(Permissions::from_mode(0o777));
    builder
        .tempdir_in(parent)
        .map_err(WriteError::io(&parent.join(name)))
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
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(false),
        Err(error) => return Err(WriteError::io(path)(error)),
        Ok(_) => {}
    }
    let is_part = |name: &OsString| {
        let letters = name.to_str().and_then(|name| name.strip_prefix(PART));
        letters.is_some_and(|it| it.len() == 6 && it.chars().all(char::is_alphanumeric))
    };
    match names(path)?.iter().all(is_part) {
        true => Ok(true),
        false => Err(WriteError::Exists(path.to_owned())),
    }
}

fn names(directory: &Path) -> Result<Vec<OsString>, WriteError> {
    let read = || -> io::Result<_> {
        let entries = fs::read_dir(directory)?;
        entries.map(|entry| Ok(entry?.file_name())).collect()
    };
    read().map_err(|error| match error.kind() {
        ErrorKind::NotADirectory | ErrorKind::NotFound => WriteError::Exists(directory.to_owned()),
        _ => WriteError::io(directory)(error),
    })
}
