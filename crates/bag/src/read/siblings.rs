//! Files of a bag of which its other files tell.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use serde::Deserialize;

use super::{BagReader, file};
use crate::{
    BagError,
    metadata::{RECORD, VERSION, within},
    yaml,
};

/// Largest number of a file that is taken to count the files before it.
const LARGEST_NUMBER: u64 = 10_000;

/// What a file's own record has of the files up to it.
#[derive(Deserialize)]
struct Told {
    #[serde(default)]
    relative_file_paths: Vec<String>,
    #[serde(default)]
    files: Vec<Counted>,
}

#[derive(Deserialize)]
struct Counted {
    path: String,
    message_count: u64,
}

/// The files that a bag has or had, and their numbers of messages as far as these are told: those that other files list,
/// and those that gaps in the numbers of `<bag>_0.mcap`, `<bag>_1.mcap` … are of. A list that does not have the file in
/// which it stands is of another bag.
pub(crate) fn siblings(files: &[PathBuf]) -> BTreeMap<PathBuf, Option<u64>> {
    let mut known: BTreeMap<PathBuf, Option<u64>> = BTreeMap::new();
    for path in files {
        let Some(name) = path.file_name().map(PathBuf::from) else {
            continue;
        };
        let told = told(path).unwrap_or_default();
        known.entry(name.clone()).or_default();
        if told.contains_key(&name) {
            for (name, count) in told {
                let known = known.entry(name).or_default();
                *known = count.max(*known);
            }
        }
    }
    for name in gaps(known.keys()) {
        known.insert(name, None);
    }
    known
}

fn told(path: &Path) -> Option<BTreeMap<PathBuf, Option<u64>>> {
    let record = file::metadata(path, RECORD.0)?;
    let told: Told = yaml::read(record.metadata.get(RECORD.1)?).ok()?;
    let listed = told.relative_file_paths.into_iter();
    let counted = told.files.into_iter();
    let all = listed
        .map(|path| (path, None))
        .chain(counted.map(|file| (file.path, Some(file.message_count))));
    Some(
        all.filter_map(|(path, count)| Some((within(&path, VERSION)?, count)))
            .collect(),
    )
}

/// The files that are not there, of bags whose first one is.
fn gaps<'a>(names: impl Iterator<Item = &'a PathBuf>) -> Vec<PathBuf> {
    let mut bags = BTreeMap::<_, BTreeSet<u64>>::new();
    for (bag, number) in names.filter_map(|name| numbered(name.to_str()?)) {
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
pub(crate) fn numbered(name: &str) -> Option<(&str, u64)> {
    let (bag, digits) = name.strip_suffix(".mcap")?.rsplit_once('_')?;
    let number: u64 = digits.parse().ok()?;
    (number.to_string() == digits).then_some((bag, number))
}

impl BagReader {
    /// Files that are not there, of a bag without `metadata.yaml`: other files list them, or the numbers in their names
    /// have a gap there.
    pub fn missing(&self) -> Vec<BagError> {
        let Some(directory) = &self.unlisted else {
            return Vec::new();
        };
        let files: Vec<_> = self.files.iter().map(|file| file.path().into()).collect();
        siblings(&files)
            .into_iter()
            .map(|(name, messages)| (directory.join(name), messages))
            .filter(|(file, _)| !file.exists())
            .map(|(file, messages)| BagError::Missing { file, messages })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_between_a_bag_s_first_file_and_its_last() {
        let gaps_of = |names: &[&str]| {
            let names: Vec<_> = names.iter().map(PathBuf::from).collect();
            let found = gaps(names.iter()).into_iter();
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
