//! Small file systems that fill up or are read-only, which root alone would not notice of permissions.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{World, binary};

/// Set where a test runs in a namespace of its own.
const APART: &str = "LGVI_TESTS_OWN_MOUNTS";

/// A namespace of mounts. It ends with the process.
const UNSHARE: [&str; 1] = ["--mount"];

/// The same without being root.
const UNSHARE_AS_USER: [&str; 3] = ["--user", "--map-root-user", "--mount"];

/// What is missing where neither works.
const HELP: &str = "small disks need namespaces of mounts. Install util-linux, and be root (in a container with CAP_SYS_ADMIN), \
     or allow user namespaces: `sysctl kernel.unprivileged_userns_clone=1`, on Ubuntu also \
     `sysctl kernel.apparmor_restrict_unprivileged_userns=0`";

/// A file system in memory.
#[derive(Debug)]
pub struct Disk {
    path: PathBuf,
}

/// Runs the body of a test, which must name itself as `module::function`, where it may mount disks.
///
/// They go with the process that they are made for, however the test ends.
#[track_caller]
pub fn with_disks(test: &str, body: impl FnOnce()) {
    if env::var_os(APART).is_some() {
        return body();
    }
    binary("lgvi");
    let works = |options: &[&str]| {
        let mut unshare = Command::new("unshare");
        unshare
            .args(options)
            .args(["mount", "-t", "tmpfs", "tmpfs", "/mnt"]);
        unshare.output().is_ok_and(|done| done.status.success())
    };
    let options: &[&str] = match () {
        () if works(&UNSHARE) => &UNSHARE,
        () if works(&UNSHARE_AS_USER) => &UNSHARE_AS_USER,
        () => panic!("{HELP}"),
    };
    let this = env::current_exe().expect("the path of the running test");
    let output = Command::new("unshare")
        .args(options)
        .arg(this)
        .args(["--exact", test, "--nocapture"])
        .env(APART, "1")
        .output()
        .expect("unshare");
    let [stdout, stderr] =
        [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(
        output.status.success() && stdout.contains("1 passed"),
        "{stdout}\n{stderr}"
    );
    eprint!("{stderr}");
}

impl Disk {
    /// Mounts a disk of so many bytes in the world's directory.
    #[track_caller]
    pub fn mount(world: &World, name: &str, bytes: u64) -> Self {
        let path = world.path(name);
        std::fs::create_dir(&path).expect("a mount point");
        let size = format!("size={bytes}");
        let disk = Self { path };
        disk.run("mount", &["-t", "tmpfs", "-o", &size, "tmpfs"]);
        disk
    }

    /// A path on the disk.
    pub fn path(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Allows no more changes.
    #[track_caller]
    pub fn make_read_only(&self) {
        self.run("mount", &["-o", "remount,ro"]);
    }

    fn run(&self, program: &str, arguments: &[&str]) {
        run(program, arguments, &self.path);
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        // A world cannot be removed with a disk in it.
        let _ = Command::new("umount")
            .arg("--lazy")
            .arg(&self.path)
            .output();
    }
}

#[track_caller]
fn run(program: &str, arguments: &[&str], path: &Path) {
    let output = Command::new(program).args(arguments).arg(path).output();
    let output = output.unwrap_or_else(|error| panic!("{program}, of util-linux: {error}"));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program} {arguments:?}: {stderr}");
}
