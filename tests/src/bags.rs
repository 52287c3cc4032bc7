//! The bags of the repository.

use std::fs;
use std::path::PathBuf;

use crate::root;

/// A bag in `bags`.
pub fn reference_bag(name: &str) -> PathBuf {
    let bag = root().join("bags").join(name);
    assert!(
        bag.join("metadata.yaml").exists(),
        "{} is missing; bags/regenerate makes it",
        bag.display()
    );
    bag
}

/// All bags in `bags`, of today's format, sorted by name.
pub fn reference_bags() -> Vec<PathBuf> {
    bags_in("bags")
}

/// All bags in `bags/earlier`, each made by an earlier version, sorted by name: those beside which what they hold is noted, too,
/// where they are no more.
pub fn earlier_bags() -> Vec<PathBuf> {
    let mut bags = bags_in("bags/earlier");
    let entries = fs::read_dir(root().join("bags/earlier")).expect("the bags");
    let notes = entries.map(|entry| entry.expect("a note").path());
    bags.extend(
        notes
            .filter(|path| {
                path.extension()
                    .is_some_and(|extension| extension == "json")
            })
            .map(|path| path.with_extension("")),
    );
    bags.sort();
    bags.dedup();
    bags
}

fn bags_in(folder: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join(folder)).expect("the bags");
    let mut bags: Vec<_> = entries
        .map(|entry| entry.expect("a bag").path())
        .filter(|path| path.join("metadata.yaml").exists())
        .collect();
    bags.sort();
    assert!(!bags.is_empty(), "{folder} has no bags");
    bags
}
