//! Where a tool puts what it makes of a bag.

use std::path::{Path, PathBuf};

/// Beside the bag, with its name and what is added to it.
pub(crate) fn beside(bag: &Path, suffix: &str) -> PathBuf {
    // `.` and `flights/..` have a name of their own too.
    let named = match bag.file_name() {
        Some(_) => bag.to_owned(),
        None => bag.canonicalize().unwrap_or_else(|_| bag.to_owned()),
    };
    let name = if bag.is_dir() {
        named.file_name()
    } else {
        named.file_stem()
    };
    let mut name = name.unwrap_or_default().to_owned();
    name.push(suffix);
    named.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn what_is_made_lies_beside_the_bag() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().canonicalize().unwrap();
        fs::create_dir_all(folder.join("a.b/inner")).unwrap();
        for bag in ["a.b", "a.b/", "a.b/.", "a.b/inner/.."] {
            assert_eq!(beside(&folder.join(bag), "_csv"), folder.join("a.b_csv"));
        }
        let file = folder.join("a.b/a_0.mcap");
        fs::write(&file, "").unwrap();
        assert_eq!(beside(&file, "_csv"), folder.join("a.b/a_0_csv"));
    }
}
