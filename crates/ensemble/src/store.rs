use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::part::{self, parts};
use crate::read::{Part, PartFile, files};
use crate::{EnsembleError, Identity, Row};

/// A directory with parts of one ensemble.
pub struct Store {
    directory: PathBuf,
    identity: Identity,
    columns: Vec<String>,
}

impl Store {
    /// The directory, made if it is not there, for parts of this ensemble with these columns of numbers.
    ///
    /// # Errors
    /// A directory that cannot be made.
    pub fn create(
        directory: &Path,
        identity: &Identity,
        columns: &[String],
    ) -> Result<Self, EnsembleError> {
        std::fs::create_dir_all(directory).map_err(EnsembleError::io(directory))?;
        Ok(Self {
            directory: directory.into(),
            identity: identity.clone(),
            columns: columns.into(),
        })
    }

    /// The directory with the parts that are in it.
    ///
    /// # Errors
    /// None there; a part that cannot be read.
    pub fn open(directory: &Path) -> Result<Self, EnsembleError> {
        let files = files(directory)?;
        let first = files.first().ok_or_else(|| EnsembleError::Nothing {
            path: directory.into(),
        })?;
        let part = Part::open(first)?;
        Ok(Self {
            directory: directory.into(),
            identity: part.identity()?,
            columns: part.columns().to_vec(),
        })
    }

    /// Where it is.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// What it has parts of.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Names of a sample's numbers.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Its parts, by their first samples.
    ///
    /// # Errors
    /// A part of another ensemble, or one that cannot be read; parts that overlap.
    pub(crate) fn parts(&self) -> Result<Vec<PartFile>, EnsembleError> {
        let files = files(&self.directory)?;
        for file in &files {
            let part = Part::open(file)?;
            part.check(&self.identity)?;
            if part.columns() != self.columns {
                return Err(EnsembleError::damaged(&file.path, "it has other columns"));
            }
        }
        check_apart(&files)?;
        Ok(files)
    }

    /// The parts of `range` that are not there yet.
    ///
    /// # Errors
    /// As [`parts`](Self::parts), and a part that is cut otherwise.
    pub(crate) fn missing(&self, range: Range<u64>) -> Result<Vec<Range<u64>>, EnsembleError> {
        let present = self.parts()?;
        let mut missing = Vec::new();
        for part in parts(range) {
            let mut met = present
                .iter()
                .filter(|file| file.range.start < part.end && part.start < file.range.end);
            match met.next() {
                None => missing.push(part),
                Some(file) if file.range == part => {}
                Some(file) => {
                    return Err(EnsembleError::Overlap {
                        first: file.path.clone(),
                        second: self.directory.join(part::file_name(&part)),
                    });
                }
            }
        }
        Ok(missing)
    }

    pub(crate) fn write(&self, rows: &[Row]) -> Result<PathBuf, EnsembleError> {
        part::write(&self.directory, &self.identity, &self.columns, rows)
    }

    /// Gives each sample that is there to `each`, by index.
    ///
    /// # Errors
    /// As for parts that cannot be read, are foreign or overlap.
    pub fn for_each(&self, mut each: impl FnMut(Row)) -> Result<(), EnsembleError> {
        for file in self.parts()? {
            Part::open(&file)?.rows()?.into_iter().for_each(&mut each);
        }
        Ok(())
    }

    /// Removes what a killed run has left of a part.
    pub(crate) fn tidy(&self) -> Result<(), EnsembleError> {
        let failed = || EnsembleError::io(&self.directory);
        for entry in std::fs::read_dir(&self.directory).map_err(failed())? {
            let entry = entry.map_err(failed())?;
            let name = entry.file_name();
            let left = name
                .to_str()
                .is_some_and(|name| name.starts_with(".samples_") && name.ends_with(".tmp"));
            if left {
                std::fs::remove_file(entry.path()).map_err(failed())?;
            }
        }
        Ok(())
    }
}

/// Refuses parts in the order of their first samples that have some in common.
pub(crate) fn check_apart(files: &[PartFile]) -> Result<(), EnsembleError> {
    match files
        .windows(2)
        .find(|pair| pair[1].range.start < pair[0].range.end)
    {
        None => Ok(()),
        Some(pair) => Err(EnsembleError::Overlap {
            first: pair[0].path.clone(),
            second: pair[1].path.clone(),
        }),
    }
}
