//! Which files a bag has.

use std::{
    ffi::OsStr,
    fs,
    path::{Component, Path, PathBuf},
};

use super::{RecoverError, original::Original, source::Source};
use crate::METADATA_FILE;

/// A damaged bag.
pub(super) struct Damaged {
    /// Its MCAP files in their order.
    pub files: Vec<PathBuf>,
    /// What `metadata.yaml` says, or why that cannot be used; none for a single file.
    pub original: Option<Result<Original, String>>,
}

/// Finds the files of a bag's directory, or takes a single file.
pub(super) fn find(bag: &Path) -> Result<Damaged, RecoverError> {
    let read_error = RecoverError::read(bag);
    if !fs::metadata(bag).map_err(&read_error)?.is_dir() {
        return Ok(Damaged {
            files: vec![bag.to_owned()],
            original: None,
        });
    }
    let mut found = Vec::new();
    for entry in fs::read_dir(bag).map_err(&read_error)? {
        let path = entry.map_err(&read_error)?.path();
        if path.extension() == Some(OsStr::new("mcap")) && !path.is_dir() {
            found.push(path);
        }
    }
    found.sort_by_cached_key(|path| {
        natural(&path.file_name().unwrap_or_default().to_string_lossy())
    });
    let original = Original::read(&bag.join(METADATA_FILE))?;
    let mut files = Vec::new();
    for listed in original
        .iter()
        .flat_map(|original| &original.relative_file_paths)
    {
        let inside = Path::new(listed)
            .components()
            .all(|component| matches!(component, Component::Normal(_) | Component::CurDir));
        let path = bag.join(listed);
        if inside && !files.contains(&path) {
            files.push(path);
        }
    }
    // Those that were begun after `metadata.yaml` was written.
    files.extend(
        found
            .into_iter()
            .filter(|path| !files.contains(path))
            .collect::<Vec<_>>(),
    );
    if !files.iter().any(|path| path.exists()) {
        return Err(RecoverError::NoBag {
            path: bag.to_owned(),
        });
    }
    // Before anything is made of them: of a bag that is being recorded, only the last file is open.
    if let Some(last) = files.last().filter(|last| last.exists()) {
        Source::open(last)?;
    }
    Ok(Damaged {
        files,
        original: Some(original),
    })
}

/// A name such that `bag_2` comes before `bag_10`.
fn natural(name: &str) -> Vec<(u64, String)> {
    let mut parts = vec![(0_u64, String::new())];
    for character in name.chars() {
        let digit = character.to_digit(10).map(u64::from);
        if let Some((number, text)) = parts.last_mut() {
            match digit {
                Some(digit) if text.is_empty() => {
                    *number = number.saturating_mul(10).saturating_add(digit)
                }
                Some(digit) => parts.push((digit, String::new())),
                None => text.push(character),
            }
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_count_as_numbers() {
        let mut names = [
            "run_10.mcap",
            "run_2.mcap",
            "run_0.mcap",
            "other_3.mcap",
            "run_1.mcap",
        ];
        names.sort_by_key(|name| natural(name));
        let expected = [
            "other_3.mcap",
            "run_0.mcap",
            "run_1.mcap",
            "run_2.mcap",
            "run_10.mcap",
        ];
        assert_eq!(names, expected);
    }
}
