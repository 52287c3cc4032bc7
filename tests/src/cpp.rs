//! Programs in C++ on Debian's Fast DDS, compiled when a test asks for them.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

use crate::root;

/// What the tests with `fast_dds` in their names need.
const NEEDS: &str = "apt-get install g++ libfastrtps-dev libfastcdr-dev (Debian 12); tests/run leaves these tests out where they are missing";

/// The program made of a source file of the repository; the first to ask for it waits until it is compiled.
#[track_caller]
pub fn fast_dds(source: &str) -> PathBuf {
    let source = root().join(source);
    let directory = root().join("target/cpp");
    fs::create_dir_all(&directory).expect("a directory for programs");
    let program = directory.join(source.file_stem().expect("a file"));
    let lock = File::create(program.with_extension("lock")).expect("a lock file");
    lock.lock().expect("a lock");
    if modified(&program) <= modified(&source) {
        compile(&source, &program);
    }
    program
}

fn modified(path: &Path) -> Option<SystemTime> {
    fs::metadata(path)
        .and_then(|metadata| metadata.modified())
        .ok()
}

#[track_caller]
fn compile(source: &Path, program: &Path) {
    let output = Command::new("g++")
        .args(["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-o"])
        .args([program, source])
        .args(["-lfastrtps", "-lfastcdr"])
        .output()
        .unwrap_or_else(|error| panic!("g++ does not start: {error}; it takes {NEEDS}"));
    assert!(
        output.status.success(),
        "cannot compile {}; it takes {NEEDS}:\n{}",
        source.display(),
        String::from_utf8_lossy(&output.stderr)
    );
}
