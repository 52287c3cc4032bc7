use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::part::{self, parts};
use crate::read::{Part, PartFile, files};
use crate::{EnsembleError, Identity, Row, temporary};

/// A directory with parts of one ensemble.
pub struct Store {
    directory: PathBuf,
    identity: Identity,
    columns: Vec<String>,
}

impl Store {
    /// Creates a store in the directory for parts of this ensemble with these columns of numbers. The directory itself
    /// is created by a [run](crate::run()) if necessary.
    ///
    /// # Errors
    /// Returns an error if the path is not a directory.
    pub fn create(
        directory: &Path,
        identity: &Identity,
        columns: &[String],
    ) -> Result<Self, EnsembleError> {
        if directory.exists() && !directory.is_dir() {
            let path = directory.into();
            return Err(EnsembleError::NotDirectory { path });
        }
        Ok(Self {
            directory: directory.into(),
            identity: identity.clone(),
            columns: columns.into(),
        })
    }

    /// Opens the store with the parts in the directory.
    ///
    /// # Errors
    /// Returns an error if there are no parts, or if the first part cannot be read.
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

    /// Returns the directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Returns the identity of the ensemble.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Returns the names of a sample's numbers.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Returns the parts, ordered by their first samples.
    ///
    /// # Errors
    /// Returns an error if a part belongs to another ensemble or cannot be read, or if parts overlap.
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

    /// Returns the parts of `range` that are missing.
    ///
    /// # Errors
    /// Returns the errors of [`parts`](Self::parts), and an error if one of the parts is damaged or incomplete.
    pub(crate) fn missing(&self, range: Range<u64>) -> Result<Vec<Range<u64>>, EnsembleError> {
        let present = self.parts()?;
        let mut missing = Vec::new();
        for part in parts(range, self.identity.part) {
            let first = present.partition_point(|file| file.range.end <= part.start);
            let end = present.partition_point(|file| file.range.start < part.end);
            let met = &present[first..end];
            for file in met {
                Part::open(file)?.rows()?;
            }
            match (met.first(), gaps(&part, met).into_iter().next()) {
                (Some(file), Some(missing)) => {
                    let path = file.path.clone();
                    return Err(EnsembleError::Cut { path, missing });
                }
                (None, Some(_)) => missing.push(part),
                (_, None) => {}
            }
        }
        Ok(missing)
    }

    pub(crate) fn write(&self, rows: &[Row]) -> Result<PathBuf, EnsembleError> {
        part::write(&self.directory, &self.identity, &self.columns, rows)
    }

    /// Passes each sample to `each`, in the order of the indices.
    ///
    /// # Errors
    /// Returns an error if parts cannot be read, belong to another ensemble or overlap.
    pub fn for_each(&self, mut each: impl FnMut(Row)) -> Result<(), EnsembleError> {
        for file in self.parts()? {
            Part::open(&file)?.rows()?.into_iter().for_each(&mut each);
        }
        Ok(())
    }

    /// Creates the directory if necessary, and removes temporary files that killed runs have left behind.
    pub(crate) fn tidy(&self) -> Result<(), EnsembleError> {
        std::fs::create_dir_all(&self.directory).map_err(EnsembleError::io(&self.directory))?;
        temporary::tidy(&self.directory).map_err(EnsembleError::io(&self.directory))
    }
}

/// Returns the ranges of `range` that are not covered by the parts. The parts must be ordered by their first samples
/// and must not overlap.
pub(crate) fn gaps(range: &Range<u64>, files: &[PartFile]) -> Vec<Range<u64>> {
    let mut gaps = Vec::new();
    let mut next = range.start;
    for file in files {
        gaps.push(next..file.range.start.min(range.end));
        next = next.max(file.range.end);
    }
    gaps.push(next..range.end);
    gaps.retain(|gap| !gap.is_empty());
    gaps
}

/// Returns an error if parts overlap. The parts must be ordered by their first samples.
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
