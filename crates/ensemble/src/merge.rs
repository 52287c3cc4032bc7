use std::io::ErrorKind;
use std::path::Path;

use crate::part::parts;
use crate::place::each_open;
use crate::store::{check_apart, gaps};
use crate::{EnsembleError, Place, Row, Store, temporary};

/// Options of a merge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MergeOptions {
    /// True if samples may be missing.
    pub allow_gaps: bool,
}

/// The result of a merge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Merged {
    /// Number of samples present.
    pub samples: u64,
    /// Number of samples missing.
    pub missing: u64,
}

/// Joins the parts in `places` in the new directory `output`. The result is byte for byte the same as that of one
/// uninterrupted run.
///
/// # Errors
/// Returns an error if there are no parts, if parts belong to different ensembles or are damaged, if samples occur
/// twice, if samples are missing unless that is allowed, or if the output exists and is not empty.
pub fn merge(
    places: impl IntoIterator<Item: Into<Place>>,
    output: &Path,
    options: MergeOptions,
) -> Result<(Store, Merged), EnsembleError> {
    let places: Vec<Place> = places.into_iter().map(Into::into).collect();
    let mut all = Vec::new();
    for place in &places {
        let found = place.parts()?;
        if found.is_empty() {
            return Err(EnsembleError::Nothing { path: place.path() });
        }
        all.extend(found);
    }
    all.sort_by_key(|file| (file.range.start, file.range.end));
    let first = all.first().ok_or_else(|| EnsembleError::Nothing {
        path: output.into(),
    })?;
    let part = first.open()?;
    let identity = part.identity()?;
    check_apart(&all)?;
    let gaps = gaps(&(0..identity.samples), &all);
    if let (Some(gap), false) = (gaps.first(), options.allow_gaps) {
        return Err(EnsembleError::Gap { range: gap.clone() });
    }
    let missing: u64 = gaps.iter().map(|gap| gap.end - gap.start).sum();
    if !is_free(output)? {
        let path = output.into();
        return Err(EnsembleError::Occupied { path });
    }
    let parent = match output.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(parent).map_err(EnsembleError::io(parent))?;
    let temporary = temporary::directory(parent).map_err(EnsembleError::io(parent))?;
    let store = Store::create(temporary.path(), &identity, part.columns())?;
    let mut waiting: Vec<Row> = Vec::new();
    for (file, opened) in all.iter().zip(each_open(&all)) {
        if waiting
            .last()
            .is_some_and(|row| row.index + 1 != file.range.start)
        {
            write(&store, &mut waiting, true)?;
        }
        waiting.extend(store.rows(&opened?)?);
        write(&store, &mut waiting, false)?;
    }
    write(&store, &mut waiting, true)?;
    // The output appears as a whole by the rename.
    std::fs::rename(temporary.path(), output).map_err(EnsembleError::io(output))?;
    let _ = temporary.keep();
    let store = Store::create(output, &identity, part.columns())?;
    let samples = identity.samples - missing;
    Ok((store, Merged { samples, missing }))
}

/// Returns true if `path` does not exist or is an empty directory.
fn is_free(path: &Path) -> Result<bool, EnsembleError> {
    match path.read_dir() {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(true),
        listing => Ok(listing.map_err(EnsembleError::io(path))?.next().is_none()),
    }
}

/// Writes the complete parts among consecutive rows, and also the remainder if no further rows follow.
fn write(store: &Store, rows: &mut Vec<Row>, ended: bool) -> Result<(), EnsembleError> {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return Ok(());
    };
    let range = first.index..last.index + 1;
    let size = store.identity().part;
    for part in parts(range.clone(), size) {
        let whole = part.end < range.end || part.end.is_multiple_of(size);
        if whole || ended {
            let rest = rows.split_off((part.end - part.start) as usize);
            store.write(&std::mem::replace(rows, rest))?;
        }
    }
    Ok(())
}
