use std::ops::Range;

use crate::part::{self, parts};
use crate::place::{PartFile, each_open};
use crate::read::Part;
use crate::{EnsembleError, Identity, Place, Row};

/// The parts of one ensemble in one place.
pub struct Store {
    place: Place,
    identity: Identity,
    columns: Vec<String>,
}

impl Store {
    /// Creates a store in the place for parts of this ensemble with these columns of numbers. A directory is created by a
    /// [run](crate::run()) if necessary.
    ///
    /// # Errors
    /// Returns an error if the path is not a directory.
    pub fn create(
        place: impl Into<Place>,
        identity: &Identity,
        columns: &[String],
    ) -> Result<Self, EnsembleError> {
        let place = place.into();
        place.check()?;
        Ok(Self {
            place,
            identity: identity.clone(),
            columns: columns.into(),
        })
    }

    /// Opens the store with the parts in the place.
    ///
    /// # Errors
    /// Returns an error if there are no parts, or if the first part cannot be read.
    pub fn open(place: impl Into<Place>) -> Result<Self, EnsembleError> {
        let place = place.into();
        let parts = place.parts()?;
        let first = parts
            .first()
            .ok_or_else(|| EnsembleError::Nothing { path: place.path() })?;
        let part = first.open()?;
        let (identity, columns) = (part.identity()?, part.columns().to_vec());
        Ok(Self {
            place,
            identity,
            columns,
        })
    }

    /// Returns the place of the parts.
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// Returns the identity of the ensemble.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Returns the names of a sample's numbers.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Returns the parts of `range` that are missing. Reads the first of the parts, and in a directory those that have samples
    /// of the range. Parts in an object store are complete, and the summary reads them.
    ///
    /// # Errors
    /// Returns an error if one of these parts is damaged, incomplete or of another ensemble, or if parts overlap.
    pub(crate) fn missing(&self, range: Range<u64>) -> Result<Vec<Range<u64>>, EnsembleError> {
        let present = self.place.parts()?;
        check_apart(&present)?;
        if let Some(first) = present.first() {
            self.check(&first.open()?)?;
        }
        let mut missing = Vec::new();
        for part in parts(range, self.identity.part) {
            let first = present.partition_point(|file| file.range.end <= part.start);
            let end = present.partition_point(|file| file.range.start < part.end);
            let met = &present[first..end];
            if self.place.is_directory() {
                for file in met {
                    self.rows(&file.open()?)?;
                }
            }
            match (met.first(), gaps(&part, met).into_iter().next()) {
                (Some(file), Some(missing)) => {
                    let path = file.path();
                    return Err(EnsembleError::Cut { path, missing });
                }
                (None, Some(_)) => missing.push(part),
                (_, None) => {}
            }
        }
        Ok(missing)
    }

    /// Writes consecutive samples as a part.
    pub(crate) fn write(&self, rows: &[Row]) -> Result<(), EnsembleError> {
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
            return Ok(());
        };
        let range = first.index..last.index + 1;
        let encoded = part::encode(&self.identity, &self.columns, rows);
        let encoded = encoded.map_err(|error| EnsembleError::Io {
            path: self.place.path(),
            source: std::io::Error::other(error),
        })?;
        self.place.write_part(&range, encoded)
    }

    /// Passes each sample to `each`, in the order of the indices.
    ///
    /// # Errors
    /// Returns an error if parts cannot be read, belong to another ensemble or overlap.
    pub fn for_each(&self, mut each: impl FnMut(Row)) -> Result<(), EnsembleError> {
        let parts = self.place.parts()?;
        check_apart(&parts)?;
        for part in each_open(&parts) {
            self.rows(&part?)?.into_iter().for_each(&mut each);
        }
        Ok(())
    }

    /// Returns the samples of a part, which must be one of this ensemble.
    pub(crate) fn rows(&self, part: &Part<'_>) -> Result<Vec<Row>, EnsembleError> {
        self.check(part)?;
        part.rows()
    }

    fn check(&self, part: &Part<'_>) -> Result<(), EnsembleError> {
        part.check(&self.identity)?;
        let (columns, samples) = (part.columns(), self.identity.samples);
        if columns != self.columns {
            return Err(part.file().damaged("it has other columns"));
        }
        if part.file().range.end > samples {
            let reason = format!("it has samples beyond the {samples} of the ensemble");
            return Err(part.file().damaged(reason));
        }
        Ok(())
    }
}

/// Returns the ranges of `range` that are not covered by the parts. The parts must be ordered by their first samples
/// and must not overlap.
pub(crate) fn gaps(range: &Range<u64>, files: &[PartFile<'_>]) -> Vec<Range<u64>> {
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
pub(crate) fn check_apart(files: &[PartFile<'_>]) -> Result<(), EnsembleError> {
    match files
        .windows(2)
        .find(|pair| pair[1].range.start < pair[0].range.end)
    {
        None => Ok(()),
        Some(pair) => Err(EnsembleError::Overlap {
            first: pair[0].path(),
            second: pair[1].path(),
        }),
    }
}
