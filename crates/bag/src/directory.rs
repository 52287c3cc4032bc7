//! The directory of a bag that is to be written.

use std::{fs, io, path::Path};

use crate::WriteError;

/// The bag's name, after which its files are named.
pub(crate) fn name(path: &Path) -> Result<String, WriteError> {
    let name = path.file_name().and_then(|name| name.to_str());
    name.map(str::to_owned).ok_or_else(|| WriteError::NoName {
        path: path.to_owned(),
    })
}

/// Makes the directory, or takes an empty one; whether it was made.
pub(crate) fn make_empty(path: &Path) -> Result<bool, WriteError> {
    let io_error = WriteError::io(path);
    let exists = || WriteError::Exists {
        path: path.to_owned(),
    };
    match fs::read_dir(path) {
        Ok(mut entries) => match entries.next() {
            None => Ok(false),
            Some(_) => Err(exists()),
        },
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            fs::create_dir_all(path).map(|()| true).map_err(io_error)
        }
        Err(error) if error.kind() == io::ErrorKind::NotADirectory => Err(exists()),
        Err(error) => Err(io_error(error)),
    }
}
