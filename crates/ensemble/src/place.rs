use std::collections::VecDeque;
use std::fmt;
use std::io::{ErrorKind, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

#[cfg(feature = "object-store")]
use lgvi_objects::{Folder, Requested, Target};

use crate::part::{file_name, range_of};
use crate::read::Part;
use crate::{EnsembleError, temporary};

/// Where the parts of an ensemble are: a directory, or a folder of an object store.
#[derive(Clone, Debug)]
pub struct Place(Kind);

#[derive(Clone, Debug)]
enum Kind {
    Directory(PathBuf),
    #[cfg(feature = "object-store")]
    Folder(Folder),
}

impl<P: AsRef<Path> + ?Sized> From<&P> for Place {
    fn from(directory: &P) -> Self {
        Self(Kind::Directory(directory.as_ref().into()))
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.path().display().fmt(f)
    }
}

impl Place {
    /// Returns the place with this path, or with this URL if it begins with a scheme and `://`.
    ///
    /// # Errors
    /// Returns an error for URLs that name no place, and for all without the feature `object-store`.
    pub fn at(path: &Path) -> Result<Self, EnsembleError> {
        match path.to_str() {
            Some(url) if url.contains("://") => Self::of_url(url),
            _ => Ok(path.into()),
        }
    }

    #[cfg(feature = "object-store")]
    fn of_url(url: &str) -> Result<Self, EnsembleError> {
        let target = Target::open(url).map_err(|error| EnsembleError::place(url, error))?;
        Ok(Self(match target {
            Target::Directory(path) => Kind::Directory(path),
            Target::Folder(folder) => Kind::Folder(folder),
        }))
    }

    #[cfg(not(feature = "object-store"))]
    fn of_url(url: &str) -> Result<Self, EnsembleError> {
        let reason = "this program was built without the feature `object-store`";
        Err(EnsembleError::place(url, reason))
    }

    /// Returns the path or URL of the place.
    pub fn path(&self) -> PathBuf {
        match &self.0 {
            Kind::Directory(path) => path.clone(),
            #[cfg(feature = "object-store")]
            Kind::Folder(folder) => folder.url().into(),
        }
    }

    /// Returns true if the place is a directory. Parts in other places are read once, for the summary.
    pub fn is_directory(&self) -> bool {
        matches!(self.0, Kind::Directory(_))
    }

    /// Writes a file beside the parts, in place of any of this name.
    ///
    /// # Errors
    /// Returns an error if the file cannot be written.
    pub fn write(&self, name: &str, contents: Vec<u8>) -> Result<(), EnsembleError> {
        let path = self.path().join(name);
        let written = match &self.0 {
            Kind::Directory(_) => std::fs::write(&path, contents),
            #[cfg(feature = "object-store")]
            Kind::Folder(folder) => folder.put(name, contents),
        };
        written.map_err(EnsembleError::io(&path))
    }

    /// Creates a directory if necessary, and removes temporary files that killed runs have left behind.
    pub(crate) fn prepare(&self) -> Result<(), EnsembleError> {
        match &self.0 {
            Kind::Directory(path) => std::fs::create_dir_all(path)
                .and_then(|()| temporary::tidy(path))
                .map_err(EnsembleError::io(path)),
            #[cfg(feature = "object-store")]
            Kind::Folder(_) => Ok(()),
        }
    }

    /// Returns an error if the place is a file.
    pub(crate) fn check(&self) -> Result<(), EnsembleError> {
        match &self.0 {
            Kind::Directory(path) if path.exists() && !path.is_dir() => {
                Err(EnsembleError::NotDirectory { path: path.clone() })
            }
            _ => Ok(()),
        }
    }

    /// Returns the parts, ordered by their first samples. There are none if the place does not exist.
    pub(crate) fn parts(&self) -> Result<Vec<PartFile<'_>>, EnsembleError> {
        let mut parts = Vec::new();
        let mut add = |name: &str| {
            parts.extend(range_of(name).map(|range| PartFile { place: self, range }));
        };
        match &self.0 {
            Kind::Directory(path) => each_file(path, &mut add).map_err(EnsembleError::io(path))?,
            #[cfg(feature = "object-store")]
            Kind::Folder(folder) => {
                let listed = folder.each_name(&mut add);
                listed.map_err(EnsembleError::io(&self.path()))?;
            }
        }
        parts.sort_by_key(|part| (part.range.start, part.range.end));
        Ok(parts)
    }

    /// Writes a part so that it is complete or absent.
    pub(crate) fn write_part(
        &self,
        range: &Range<u64>,
        part: Vec<u8>,
    ) -> Result<(), EnsembleError> {
        let name = file_name(range);
        match &self.0 {
            Kind::Directory(directory) => write_file(directory, &directory.join(name), &part),
            #[cfg(feature = "object-store")]
            Kind::Folder(_) => self.write(&name, part),
        }
    }
}

/// Passes the names of the files of a directory to `each`. There are none if it does not exist.
fn each_file(directory: &Path, each: &mut dyn FnMut(&str)) -> std::io::Result<()> {
    let listing = match directory.read_dir() {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        listing => listing?,
    };
    for entry in listing {
        entry?.file_name().to_str().into_iter().for_each(&mut *each);
    }
    Ok(())
}

/// Writes a file under a temporary name and renames it.
fn write_file(directory: &Path, path: &Path, contents: &[u8]) -> Result<(), EnsembleError> {
    let mut temporary = temporary::file(directory).map_err(EnsembleError::io(directory))?;
    let written = temporary.write_all(contents);
    let written = written.and_then(|()| temporary.as_file().sync_all());
    written.map_err(EnsembleError::io(path))?;
    let kept = temporary.persist(path);
    kept.map_err(|error| EnsembleError::io(path)(error.error))?;
    Ok(())
}

/// The file of a part and its samples.
#[derive(Clone, Debug)]
pub(crate) struct PartFile<'a> {
    place: &'a Place,
    pub(crate) range: Range<u64>,
}

impl<'a> PartFile<'a> {
    pub(crate) fn path(&self) -> PathBuf {
        self.place.path().join(file_name(&self.range))
    }

    pub(crate) fn damaged(&self, reason: impl ToString) -> EnsembleError {
        EnsembleError::damaged(&self.path(), reason)
    }

    pub(crate) fn open(&self) -> Result<Part<'a>, EnsembleError> {
        self.request().open(self)
    }

    fn request(&self) -> Opening {
        match &self.place.0 {
            Kind::Directory(_) => Opening::File,
            #[cfg(feature = "object-store")]
            Kind::Folder(folder) => Opening::Object(folder.get(&file_name(&self.range))),
        }
    }
}

/// A part that is being opened.
enum Opening {
    File,
    #[cfg(feature = "object-store")]
    Object(Requested),
}

impl Opening {
    fn open<'a>(self, part: &PartFile<'a>) -> Result<Part<'a>, EnsembleError> {
        let path = part.path();
        match self {
            Self::File => {
                let file = std::fs::File::open(&path).map_err(EnsembleError::io(&path))?;
                Part::read(part, file)
            }
            #[cfg(feature = "object-store")]
            Self::Object(requested) => {
                Part::read(part, requested.wait().map_err(EnsembleError::io(&path))?)
            }
        }
    }
}

/// Number of objects that are requested before they are needed.
const AHEAD: usize = 16;

/// Opens parts one after the other.
pub(crate) fn each_open<'a>(
    parts: &[PartFile<'a>],
) -> impl Iterator<Item = Result<Part<'a>, EnsembleError>> {
    let mut left = parts.iter();
    let mut opening = VecDeque::new();
    std::iter::from_fn(move || {
        while opening.len() < AHEAD
            && let Some(part) = left.next()
        {
            opening.push_back((part, part.request()));
        }
        let (part, requested) = opening.pop_front()?;
        Some(requested.open(part))
    })
}
