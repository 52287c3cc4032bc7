//! What has been written into an output directory, and when: what a run has kept is told from what was there before.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::error::BenchError;

/// Tables and pictures below a directory, with the times when they were last written.
#[derive(Clone, Debug, Default)]
pub(crate) struct Contents(BTreeMap<PathBuf, SystemTime>);

impl Contents {
    /// Nothing where there is no such directory.
    pub(crate) fn of(directory: &Path) -> Result<Self, BenchError> {
        let mut contents = BTreeMap::new();
        for (below, extension) in [("tables", "md"), ("", "svg")] {
            let place = directory.join(below);
            let refuse = |source| BenchError::Read {
                path: place.clone(),
                source,
            };
            if !place.exists() {
                continue;
            }
            for entry in std::fs::read_dir(&place).map_err(refuse)? {
                let entry = entry.map_err(refuse)?;
                let name = PathBuf::from(entry.file_name());
                if name.extension().is_some_and(|found| found == extension) {
                    let written = entry.metadata().and_then(|data| data.modified());
                    contents.insert(Path::new(below).join(name), written.map_err(refuse)?);
                }
            }
        }
        Ok(Self(contents))
    }

    /// What has been written since, relative to the directory.
    pub(crate) fn since(self, before: &Self) -> BTreeSet<PathBuf> {
        let new = self.0.into_iter();
        new.filter(|(path, written)| before.0.get(path) != Some(written))
            .map(|(path, _)| path)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::time::{Duration, SystemTime};

    use super::Contents;

    #[test]
    fn what_is_new_or_written_again_is_told_from_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("output");
        let before = Contents::of(&output).unwrap();
        std::fs::create_dir_all(output.join("tables")).unwrap();
        let names = ["tables/a.md", "tables/b.md", "c.svg", "d.json"];
        let past = SystemTime::now() - Duration::from_secs(60);
        for name in names {
            std::fs::write(output.join(name), name).unwrap();
            let file = std::fs::File::open(output.join(name)).unwrap();
            file.set_modified(past).unwrap();
        }
        let first = Contents::of(&output).unwrap();
        let all = ["c.svg", "tables/a.md", "tables/b.md"].map(PathBuf::from);
        assert_eq!(first.clone().since(&before), all.into());
        std::fs::write(output.join("tables/b.md"), "tables/b.md").unwrap();
        let second = Contents::of(&output).unwrap();
        assert_eq!(second.since(&first), [PathBuf::from("tables/b.md")].into());
    }
}
