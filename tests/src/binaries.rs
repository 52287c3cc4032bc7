//! The programs under test. They belong to other packages, so that Cargo does not say where they are.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::time::SystemTime;

/// Of the programs, as of the tests.
const FEATURES: &[&str] = &[
    #[cfg(feature = "object-store")]
    "lgvi/object-store",
    #[cfg(feature = "security")]
    "lgvi_middleware/security",
    #[cfg(feature = "zenoh")]
    "lgvi_middleware/zenoh",
];

const PROGRAMS: [&str; 8] = [
    "examples/fly",
    "examples/own_node",
    "examples/wheel_controller",
    "lgvi",
    "lgvi_propagator",
    "lgvi_planner",
    "lgvi_recorder",
    "lgvi_player",
];

/// A program of the workspace, which `tests/run` has built; all of them are built where one is missing or older than its
/// sources.
pub fn binary(name: &str) -> PathBuf {
    static DIRECTORY: OnceLock<PathBuf> = OnceLock::new();
    assert!(
        PROGRAMS.contains(&name),
        "{name:?} is no program of the workspace"
    );
    DIRECTORY
        .get_or_init(|| {
            let directory = directory();
            if PROGRAMS.iter().any(|name| outdated(&directory.join(name))) {
                build(&directory);
            }
            directory
        })
        .join(name)
}

/// Where Cargo puts programs: this one is in `deps` there.
fn directory() -> PathBuf {
    let this = env::current_exe().expect("the path of the running test");
    let directory = this
        .ancestors()
        .nth(2)
        .expect("<target>/<profile>/deps/<test>");
    directory.to_owned()
}

/// Whether a program is missing or older than one of the files that Cargo says it was made from.
fn outdated(program: &Path) -> bool {
    let modified = |file: &Path| fs::metadata(file).and_then(|metadata| metadata.modified());
    let newer = |source: &Path, built: SystemTime| modified(source).is_ok_and(|time| time > built);
    let (Ok(built), Ok(rule)) = (
        modified(program),
        fs::read_to_string(program.with_extension("d")),
    ) else {
        return true;
    };
    let sources = rule
        .split_once(": ")
        .map_or("", |(_, sources)| sources)
        .replace("\\ ", "\0");
    sources
        .split_whitespace()
        .any(|source| newer(Path::new(&source.replace('\0', " ")), built))
}

fn build(directory: &Path) {
    let target = directory.parent().expect("<target>/<profile>");
    let profile = cargo_profile(directory);
    let what = ["--workspace", "--bins", "--examples", "--profile", profile];
    cargo_build(target, &what);
}

/// The example `fly` in release, built if it is missing or outdated.
pub fn fly_in_release() -> PathBuf {
    let directory = directory();
    let target = directory.parent().expect("<target>/<profile>");
    let program = target.join("release/examples/fly");
    if outdated(&program) {
        cargo_build(target, &["--workspace", "--example", "fly", "--release"]);
    }
    program
}

/// The profile whose programs lie in a directory.
fn cargo_profile(directory: &Path) -> &str {
    match directory.file_name().and_then(|name| name.to_str()) {
        Some("debug") | None => "dev",
        Some(profile) => profile,
    }
}

fn cargo_build(target: &Path, what: &[&str]) {
    let output = Command::new(env!("CARGO"))
        .arg("build")
        .args(what)
        .args(FEATURES.iter().flat_map(|feature| ["--features", feature]))
        .arg("--target-dir")
        .arg(target)
        .current_dir(crate::root())
        .output()
        .expect("cargo starts");
    assert!(
        output.status.success(),
        "the programs under test are missing or outdated in {}, and cannot be built with {what:?}:\n{}",
        target.display(),
        String::from_utf8_lossy(&output.stderr)
    );
}
