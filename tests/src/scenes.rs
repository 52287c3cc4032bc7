//! Scene files: those of the repository, and changed copies.

use std::fs;
use std::path::PathBuf;

use crate::{World, root};

/// A scene of the repository.
pub fn scene(name: &str) -> PathBuf {
    root().join("scenes").join(name).with_extension("toml")
}

/// The names of all scenes of the repository, sorted.
pub fn shipped() -> Vec<String> {
    let files = fs::read_dir(root().join("scenes")).expect("the scenes");
    let mut names: Vec<_> = files
        .map(|file| file.expect("a scene").path())
        .filter(|path| {
            path.extension()
                .is_some_and(|extension| extension == "toml")
        })
        .filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()))
        .collect();
    names.sort();
    names
}

/// A copy of a scene in which each first occurrence of a text is replaced by another.
#[track_caller]
pub fn edited(world: &World, name: &str, changes: &[(&str, &str)]) -> PathBuf {
    let mut text = fs::read_to_string(scene(name)).expect("a scene");
    for (from, to) in changes {
        assert!(text.contains(from), "{from:?} is not in {name}");
        text = text.replacen(from, to, 1);
    }
    let path = world.path(&format!("{name}.toml"));
    fs::write(&path, text).expect("a scene's copy");
    path
}
