//! The files of a bag.

use std::{
    collections::{BTreeMap, BTreeSet},
    ffi::OsString,
    fs, io,
    path::{Path, PathBuf},
};

use crate::{
    BagError, METADATA_FILE,
    metadata::{Metadata, within},
};

/// Endings of names of MCAP files, as a whole compressed ones included.
const MCAP_FILES: [&str; 2] = [".mcap", ".mcap.zstd"];

/// Largest number of a file that is taken to count the files before it.
const LARGEST_NUMBER: u64 = 10_000;

/// A bag's MCAP files in their order, by their paths in its directory.
#[derive(Default)]
pub(crate) struct Listing {
    pub directory: PathBuf,
    /// Those that `metadata.yaml` lists.
    pub files: Vec<PathBuf>,
    /// Those that it does not list, in the order of their numbers.
    pub others: Vec<PathBuf>,
    /// `metadata.yaml`, if there is one, or why it cannot be read.
    pub metadata: Option<Result<Metadata, BagError>>,
    /// What is wrong with its list of files.
    pub faults: Vec<BagError>,
}

impl Listing {
    /// Of a bag's directory, or a single file; of one whose files are compressed as a whole only if they can be.
    pub fn read(path: &Path, may_be_compressed: bool) -> Result<Self, BagError> {
        if !fs::metadata(path).map_err(BagError::io(path))?.is_dir() {
            return Ok(Self {
                directory: path.parent().unwrap_or(Path::new("")).to_owned(),
                others: path.file_name().into_iter().map(PathBuf::from).collect(),
                ..Self::default()
            });
        }
        let file = path.join(METADATA_FILE);
        let mut listing = Self {
            directory: path.to_owned(),
            others: mcap_files(path).map_err(BagError::io(path))?,
            metadata: file
                .exists()
                .then(|| Metadata::read(&file, may_be_compressed)),
            ..Self::default()
        };
        if let Some(Ok(metadata)) = &listing.metadata {
            let mut known = BTreeSet::new();
            for listed in &metadata.relative_file_paths {
                let reason = match within(listed, metadata.version) {
                    None => "expected a path within the bag's directory",
                    Some(file) if !known.insert(file.clone()) => "expected each file once",
                    Some(file) => {
                        listing.files.push(file);
                        continue;
                    }
                };
                let reason = format!("a listed file is {listed}, {reason}");
                listing.faults.push(BagError::invalid(&file, reason));
            }
            listing.others.retain(|other| !known.contains(other));
        }
        if listing.files.is_empty() && listing.others.is_empty() && listing.metadata.is_none() {
            let expected = "metadata.yaml and the files that it lists, or .mcap files";
            return Err(BagError::invalid(
                path,
                format!("no .mcap file, expected {expected}"),
            ));
        }
        Ok(listing)
    }

    /// Files that are not there: the numbers in the names of those that are have a gap there, in a bag whose first file is.
    pub fn gaps(&self) -> Vec<PathBuf> {
        let mut bags = BTreeMap::<_, BTreeSet<u64>>::new();
        for (bag, number) in self
            .others
            .iter()
            .filter_map(|name| numbered(name.to_str()?))
        {
            bags.entry(bag).or_default().insert(number);
        }
        let mut gaps = Vec::new();
        for (bag, numbers) in bags {
            let last = numbers.last().copied().unwrap_or(0);
            if numbers.contains(&0) && last <= LARGEST_NUMBER {
                let gone = (0..last).filter(|number| !numbers.contains(number));
                gaps.extend(gone.map(|number| PathBuf::from(format!("{bag}_{number}.mcap"))));
            }
        }
        gaps
    }
}

/// The MCAP files of a directory in their order.
fn mcap_files(directory: &Path) -> io::Result<Vec<PathBuf>> {
    let entries = fs::read_dir(directory)?;
    let names = entries.map(|entry| Ok(entry?.file_name()));
    let mut names = names.collect::<io::Result<Vec<OsString>>>()?;
    names.retain(|name| {
        let text = name.to_string_lossy();
        MCAP_FILES.iter().any(|ending| text.ends_with(ending)) && !directory.join(name).is_dir()
    });
    let mut files: Vec<_> = names.into_iter().map(PathBuf::from).collect();
    sort(&mut files);
    Ok(files)
}

/// Brings the files of a bag into the order of the numbers in their names: `run_2` is before `run_10`.
pub(crate) fn sort(files: &mut [PathBuf]) {
    files.sort_by(|a, b| (a.as_os_str().len(), a).cmp(&(b.as_os_str().len(), b)));
}

/// `run` and 7 of `run_7.mcap`.
fn numbered(name: &str) -> Option<(&str, u64)> {
    let (bag, digits) = name.strip_suffix(".mcap")?.rsplit_once('_')?;
    let number: u64 = digits.parse().ok()?;
    (number.to_string() == digits).then_some((bag, number))
}
