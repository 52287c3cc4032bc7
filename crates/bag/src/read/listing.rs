//! The files of a bag.

use std::{
    cmp::Ordering,
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

/// A bag's MCAP files in their order, and its `metadata.yaml` if it has one.
#[derive(Default)]
pub(crate) struct Listing {
    pub files: Vec<PathBuf>,
    pub metadata: Option<(PathBuf, Metadata)>,
    /// The directory, where no metadata lists its files.
    pub unlisted: Option<PathBuf>,
    /// What is wrong with the list of files.
    pub faults: Vec<BagError>,
    /// What is odd about it.
    pub odd: Vec<BagError>,
}

impl Listing {
    /// Of a bag's directory, or a single file.
    pub fn read(path: &Path) -> Result<Self, BagError> {
        if !fs::metadata(path).map_err(BagError::io(path))?.is_dir() {
            return Ok(Self {
                files: vec![path.to_owned()],
                ..Self::default()
            });
        }
        let file = path.join(METADATA_FILE);
        if !file.exists() {
            return Ok(Self {
                files: mcap_files(path)?,
                unlisted: Some(path.to_owned()),
                ..Self::default()
            });
        }
        let metadata = Metadata::read(&file)?;
        let within = |listed: &String| {
            let found = within(listed, metadata.version).map(|relative| path.join(relative));
            let expected = "a path within the bag's directory";
            found.ok_or_else(|| BagError::unexpected(&file, "a listed file", listed, expected))
        };
        let mut files: Vec<PathBuf> = Vec::new();
        let mut known = BTreeSet::new();
        let mut faults = Vec::new();
        for listed in metadata.relative_file_paths.iter().map(within) {
            let listed = listed?;
            if known.insert(listed.clone()) {
                files.push(listed);
            } else {
                let listed = listed.display();
                faults.push(BagError::unexpected(
                    &file,
                    "a file listed twice",
                    listed,
                    "each file once",
                ));
            }
        }
        let mut others = mcap_files(path).unwrap_or_default();
        others.retain(|other| !known.contains(other));
        let others = others.into_iter();
        Ok(Self {
            odd: others.map(|file| BagError::Unlisted { file }).collect(),
            faults,
            files,
            metadata: Some((file, metadata)),
            unlisted: None,
        })
    }
}

/// The MCAP files of a directory in their natural order.
pub(crate) fn mcap_files(directory: &Path) -> Result<Vec<PathBuf>, BagError> {
    let names = || {
        let entries = fs::read_dir(directory)?;
        entries
            .map(|entry| Ok(entry?.file_name()))
            .collect::<io::Result<_>>()
    };
    let mut names: Vec<OsString> = names().map_err(BagError::io(directory))?;
    names.retain(|name| {
        let name = name.to_string_lossy();
        MCAP_FILES.iter().any(|ending| name.ends_with(ending))
    });
    if names.is_empty() {
        return Err(BagError::NoBag {
            path: directory.to_owned(),
        });
    }
    let mut files: Vec<_> = names.iter().map(|name| directory.join(name)).collect();
    files.sort_by(|a, b| natural(a, b));
    Ok(files)
}

/// The files that are not there, of bags whose first one is.
pub(crate) fn gaps(names: &[PathBuf]) -> Vec<PathBuf> {
    let mut bags = BTreeMap::<_, BTreeSet<u64>>::new();
    for (bag, number) in names.iter().filter_map(|name| numbered(name.to_str()?)) {
        bags.entry(bag).or_default().insert(number);
    }
    let mut gaps = Vec::new();
    for (bag, numbers) in bags {
        let last = numbers.last().copied().unwrap_or(0);
        if numbers.contains(&0) && last <= LARGEST_NUMBER {
            let gone = (0..last).filter(|number| !numbers.contains(number));
            gaps.extend(gone.map(|number| format!("{bag}_{number}.mcap").into()));
        }
    }
    gaps
}

/// `run` and 7 of `run_7.mcap`.
fn numbered(name: &str) -> Option<(&str, u64)> {
    let (bag, digits) = name.strip_suffix(".mcap")?.rsplit_once('_')?;
    let number: u64 = digits.parse().ok()?;
    (number.to_string() == digits).then_some((bag, number))
}

/// Order of names in which numbers count as such: `run_2` is before `run_10`.
pub(crate) fn natural(a: &Path, b: &Path) -> Ordering {
    let [first, second] = [a, b].map(|path| path.as_os_str().as_encoded_bytes());
    by_numbers(first, second).then(a.cmp(b))
}

fn by_numbers(mut a: &[u8], mut b: &[u8]) -> Ordering {
    loop {
        let (number_a, number_b) = (digits(a), digits(b));
        if !number_a.is_empty() && !number_b.is_empty() {
            (a, b) = (&a[number_a.len()..], &b[number_b.len()..]);
            let value = |digits: &[u8]| -> Vec<u8> {
                let digits = digits.iter().copied();
                digits.skip_while(|digit| *digit == b'0').collect()
            };
            let (value_a, value_b) = (value(number_a), value(number_b));
            let order = value_a
                .len()
                .cmp(&value_b.len())
                .then(value_a.cmp(&value_b));
            if order.is_ne() {
                return order;
            }
            continue;
        }
        match (a.split_first(), b.split_first()) {
            (Some((first_a, rest_a)), Some((first_b, rest_b))) if first_a == first_b => {
                (a, b) = (rest_a, rest_b);
            }
            _ => return a.cmp(b),
        }
    }
}

/// The digits that a name starts with.
fn digits(name: &[u8]) -> &[u8] {
    let end = name.iter().position(|byte| !byte.is_ascii_digit());
    &name[..end.unwrap_or(name.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_their_natural_order() {
        let mut names = [
            "run_10", "run_9", "run", "run_010", "a_2_1", "a_10_1", "run_2",
        ];
        names.sort_by(|a, b| natural(a.as_ref(), b.as_ref()));
        assert_eq!(
            names,
            [
                "a_2_1", "a_10_1", "run", "run_2", "run_9", "run_010", "run_10"
            ]
        );
    }
    #[test]
    fn gaps_are_between_a_bag_s_first_file_and_its_last() {
        let gaps_of = |names: &[&str]| {
            let names: Vec<_> = names.iter().map(PathBuf::from).collect();
            let found = gaps(&names).into_iter();
            found
                .map(|name| name.display().to_string())
                .collect::<Vec<_>>()
        };
        assert_eq!(
            gaps_of(&["a_0.mcap", "a_3.mcap", "b_0.mcap", "b_1.mcap"]),
            ["a_1.mcap", "a_2.mcap"]
        );
        assert!(gaps_of(&["a_5.mcap", "a_7.mcap"]).is_empty());
        assert!(gaps_of(&["a_0.mcap", "a_20240131.mcap"]).is_empty());
        assert!(gaps_of(&["a_0.mcap", "a_02.mcap", "a.mcap", "7.mcap"]).is_empty());
    }
}
