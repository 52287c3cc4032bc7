//! Where the files lie that a bag's metadata lists.

use std::path::{Component, Path, PathBuf};

/// Metadata up to this version lists files with the directory's name before theirs.
const LAST_WITH_DIRECTORY: u32 = 3;

/// A listed path relative to the bag's directory, whatever that is called now, if it lies therein.
pub(crate) fn within(listed: &str, version: u32) -> Option<PathBuf> {
    let mut parts = Vec::new();
    for component in Path::new(listed).components() {
        match component {
            Component::Normal(part) => parts.push(part),
            Component::CurDir => {}
            _ => return None,
        }
    }
    if version <= LAST_WITH_DIRECTORY && parts.len() > 1 {
        parts.remove(0);
    }
    (!parts.is_empty()).then(|| parts.into_iter().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_within_the_bag() {
        let within =
            |listed, version| within(listed, version).map(|path| path.display().to_string());
        for (listed, version, expected) in [
            ("run_0.mcap", 9, Some("run_0.mcap")),
            ("./run_0.mcap", 5, Some("run_0.mcap")),
            ("sub/run_0.mcap", 4, Some("sub/run_0.mcap")),
            ("run/run_0.mcap", 3, Some("run_0.mcap")),
            ("run/sub/run_0.mcap", 3, Some("sub/run_0.mcap")),
            ("run_0.mcap", 3, Some("run_0.mcap")),
            ("/run_0.mcap", 9, None),
            ("../run_0.mcap", 9, None),
            ("a/../../run_0.mcap", 9, None),
            ("", 9, None),
            (".", 9, None),
        ] {
            assert_eq!(within(listed, version).as_deref(), expected, "{listed}");
        }
    }
}
