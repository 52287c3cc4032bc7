use std::fmt;
use std::io::{ErrorKind, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::part::{file_name, range_of};
use crate::{EnsembleError, temporary};

/// Where the parts of an ensemble are.
#[derive(Clone, Debug)]
pub struct Place {
    directory: PathBuf,
}

impl<P: AsRef<Path> + ?Sized> From<&P> for Place {
    fn from(directory: &P) -> Self {
        let directory = directory.as_ref().into();
        Self { directory }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.directory.display().fmt(f)
    }
}

impl Place {
    /// Returns an error if parts cannot be written to the place.
    pub(crate) fn check(&self) -> Result<(), EnsembleError> {
        let path = self.path();
        if path.exists() && !path.is_dir() {
            return Err(EnsembleError::NotDirectory { path });
        }
        Ok(())
    }

    /// Returns the path of the place.
    pub fn path(&self) -> PathBuf {
        self.directory.clone()
    }

    /// Returns the path of a part.
    pub(crate) fn path_of(&self, range: &Range<u64>) -> PathBuf {
        self.path().join(file_name(range))
    }

    /// Writes a file beside the parts, in place of any of this name.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write(&self, name: &str, contents: &[u8]) -> Result<(), EnsembleError> {
        let path = self.path().join(name);
        std::fs::write(&path, contents).map_err(EnsembleError::io(&path))
    }

    /// Returns the parts, ordered by their first samples. There are none if the place does not exist.
    pub(crate) fn parts(&self) -> Result<Vec<PartFile<'_>>, EnsembleError> {
        let mut parts = Vec::new();
        self.each_name(|name| {
            parts.extend(range_of(name).map(|range| PartFile { place: self, range }));
        })?;
        parts.sort_by_key(|part| (part.range.start, part.range.end));
        Ok(parts)
    }

    fn each_name(&self, mut each: impl FnMut(&str)) -> Result<(), EnsembleError> {
        let directory = &self.directory;
        let listing = match directory.read_dir() {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            listing => listing.map_err(EnsembleError::io(directory))?,
        };
        for entry in listing {
            let entry = entry.map_err(EnsembleError::io(directory))?;
            entry.file_name().to_str().into_iter().for_each(&mut each);
        }
        Ok(())
    }

    /// Writes a part so that it is complete or absent.
    pub(crate) fn write_part(&self, range: &Range<u64>, part: &[u8]) -> Result<(), EnsembleError> {
        let path = self.path_of(range);
        let directory = &self.directory;
        let mut temporary = temporary::file(directory).map_err(EnsembleError::io(directory))?;
        let written = temporary.write_all(part);
        let written = written.and_then(|()| temporary.as_file().sync_all());
        written.map_err(EnsembleError::io(&path))?;
        let kept = temporary.persist(&path);
        kept.map_err(|error| EnsembleError::io(&path)(error.error))?;
        Ok(())
    }

    /// Creates the directory if necessary, and removes temporary files that killed runs have left behind.
    pub(crate) fn prepare(&self) -> Result<(), EnsembleError> {
        std::fs::create_dir_all(&self.directory).map_err(EnsembleError::io(&self.directory))?;
        temporary::tidy(&self.directory).map_err(EnsembleError::io(&self.directory))
    }
}

/// The file of a part and its samples.
#[derive(Clone, Debug)]
pub(crate) struct PartFile<'a> {
    pub(crate) place: &'a Place,
    pub(crate) range: Range<u64>,
}

impl PartFile<'_> {
    pub(crate) fn path(&self) -> PathBuf {
        self.place.path_of(&self.range)
    }

    pub(crate) fn damaged(&self, reason: impl ToString) -> EnsembleError {
        EnsembleError::damaged(&self.path(), reason)
    }
}
