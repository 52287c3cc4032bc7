//! What a ROS 2 node is names no wire: arrows go down only.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Source files below a directory, but for the rooms of the wires.
fn above_the_wires(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        let is_wire = path.ends_with("ros/dds") || path.ends_with("ros/zenoh");
        if path.is_dir() && !is_wire {
            above_the_wires(&path, found);
        } else if path.is_file() {
            found.push(path);
        }
    }
}

#[test]
fn nothing_above_the_wires_uses_what_is_behind_them() {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    above_the_wires(&sources, &mut files);
    assert!(files.len() > 30, "{}", files.len());
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        // Targets of the log are strings.
        let code = text.lines().filter(|line| !line.contains("\"rustdds::"));
        for line in code {
            let names = ["rustdds::", "ros2_client::", " ::zenoh", "zenoh_ext::"];
            let named = names.iter().any(|name| line.contains(name));
            assert!(!named, "{}: {line}", file.display());
        }
    }
}
