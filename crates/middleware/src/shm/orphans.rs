//! Descriptions of services whose maker was killed before it had written them.
//!
//! iceoryx2 0.10 makes the file of a description first, which only its owner may read and write, writes it, and then takes
//! away the permission to write. The cleaning of dead nodes passes over a file that has not come so far, and nobody can make
//! the service again while it is there.
//!
//! A maker that is only slow, or stopped, is still there: it has put a tag with its node before it began.

use std::{
    collections::BTreeMap,
    ffi::OsStr,
    fs,
    os::unix::{
        ffi::OsStrExt,
        fs::{MetadataExt, PermissionsExt},
    },
    path::{Path, PathBuf},
    time::{Duration, Instant, SystemTime},
};

use iceoryx2::{
    config::Config,
    node::{Node, NodeState},
    prelude::{CallbackProgression, FileName, SemanticString},
};
use tracing::{info, warn};

use super::Service;
use crate::node::FileLock;

/// The permissions of a description that is being written.
const UNFINISHED: u32 = 0o600;

/// How long nobody takes to write a description of some kilobytes.
const ABANDONED: Duration = Duration::from_secs(20);

/// Held in the root by the process that removes descriptions: another one could remove a new file of the same name.
const LOCK: &str = "lgvi_orphans.lock";

/// The unfinished descriptions that this process has seen. How old they are is measured by its own clock, whatever the
/// time of the system does.
#[derive(Debug, Default)]
pub(super) struct Orphans(BTreeMap<PathBuf, Sighting>);

#[derive(Debug, Clone, Copy)]
struct Sighting {
    state: State,
    since: Instant,
}

/// An unfinished file, as it was seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct State {
    inode: u64,
    modified: SystemTime,
}

impl Orphans {
    /// Removes the unfinished descriptions that nobody has touched for as long as this process has seen them, if that is long.
    pub(super) fn remove(&mut self, config: &Config) {
        self.look(config);
        if self.abandoned(ABANDONED).next().is_none() {
            return;
        }
        let root = path(config.global.root_path());
        // Another process that holds it does the same.
        let Ok(_lock) = FileLock::take_in(&root, LOCK, "removes what killed processes have left")
        else {
            return;
        };
        for (file, state) in self.abandoned(ABANDONED) {
            if !has_maker(config, file) && unfinished(file) == Some(state) {
                remove(file);
            }
        }
    }

    /// Takes note of the unfinished descriptions that there are, and forgets the others.
    fn look(&mut self, config: &Config) {
        let directory = path(&config.global.service_dir());
        let entries = fs::read_dir(directory).into_iter().flatten().flatten();
        let files = entries.map(|entry| entry.path());
        let descriptions = files.filter(|file| service(config, file).is_some());
        self.0 = descriptions
            .filter_map(|file| {
                let state = unfinished(&file)?;
                let before = self.0.get(&file).filter(|before| before.state == state);
                let since = before.map_or_else(Instant::now, |before| before.since);
                Some((file, Sighting { state, since }))
            })
            .collect();
    }

    /// What has been the same for so long.
    fn abandoned(&self, age: Duration) -> impl Iterator<Item = (&Path, State)> {
        let old = self
            .0
            .iter()
            .filter(move |(_, seen)| seen.since.elapsed() >= age);
        old.map(|(file, seen)| (file.as_path(), seen.state))
    }
}

fn remove(file: &Path) {
    let shown = file.display();
    match fs::remove_file(file) {
        Ok(()) => info!(file = %shown, "removed what a killed process has left of a service"),
        Err(error) => warn!(file = %shown, %error, "what is left of a service cannot be removed"),
    }
}

/// The file as it is, if it is one that is being written.
fn unfinished(file: &Path) -> Option<State> {
    let metadata = fs::symlink_metadata(file).ok()?;
    let mode = metadata.permissions().mode() & 0o777;
    let is_unfinished = metadata.is_file() && mode == UNFINISHED;
    is_unfinished.then_some(State {
        inode: metadata.ino(),
        modified: metadata.modified().ok()?,
    })
}

/// What iceoryx2 calls the service that a file describes, if its name is that of a description.
fn service<'f>(config: &Config, file: &'f Path) -> Option<&'f str> {
    let suffix = &config.global.service.static_config_storage_suffix;
    let name = file.file_name()?.to_str()?;
    let name = name.strip_prefix(text(&config.global.prefix)?)?;
    name.strip_suffix(text(suffix)?)
}

/// Whether a node that is not dead has a tag of the service that a file describes; so too if that cannot be told.
fn has_maker(config: &Config, file: &Path) -> bool {
    let (Some(service), Some(prefix)) = (service(config, file), text(&config.global.prefix)) else {
        return true;
    };
    let tag = format!("{prefix}{service}{}", config.global.node.service_tag_suffix);
    let nodes = path(&config.global.node_dir());
    let mut found = false;
    let listed = Node::<Service>::list(config, |state| {
        let dead = matches!(state, NodeState::Dead(_));
        let node = nodes.join(state.node_id().value().to_string());
        found |= !dead && node.join(&tag).exists();
        CallbackProgression::Continue
    });
    found || listed.is_err()
}

fn text(name: &FileName) -> Option<&str> {
    str::from_utf8(name.as_bytes()).ok()
}

fn path(path: &iceoryx2::prelude::Path) -> PathBuf {
    OsStr::from_bytes(path.as_bytes()).into()
}

#[cfg(test)]
mod tests {
    use std::fs::{File, Permissions};

    use tempfile::TempDir;

    use super::*;
    use crate::shm::{ShmNode, ShmOptions};

    struct World {
        _root: TempDir,
        options: ShmOptions,
        config: Config,
    }

    impl World {
        fn new() -> Self {
            let root = tempfile::tempdir().unwrap();
            let options = ShmOptions {
                root: Some(root.path().into()),
                ..ShmOptions::default()
            };
            let config = options.config().unwrap();
            fs::create_dir(path(&config.global.service_dir())).unwrap();
            Self {
                _root: root,
                options,
                config,
            }
        }

        /// An unfinished file among the descriptions.
        fn file(&self, name: &str) -> PathBuf {
            let file = path(&self.config.global.service_dir()).join(name);
            let made = File::create(&file).unwrap();
            made.set_permissions(Permissions::from_mode(UNFINISHED))
                .unwrap();
            file
        }

        /// That of a service.
        fn description(&self, service: &str) -> PathBuf {
            self.file(&format!("{}{service}.service", self.options.prefix()))
        }
    }

    /// As if all had been seen so long ago.
    fn later(orphans: &mut Orphans) {
        for seen in orphans.0.values_mut() {
            seen.since -= ABANDONED;
        }
    }

    #[test]
    fn what_is_unfinished_for_long_is_removed_and_nothing_else() {
        let world = World::new();
        let prefix = world.options.prefix();
        let [orphan, touched] = ["a", "b"].map(|service| world.description(service));
        let foreign = ["notes", "a.service", &format!("{prefix}a.dynamic")];
        let foreign = foreign.map(|name| world.file(name));
        let finished = world.description("c");
        fs::set_permissions(&finished, Permissions::from_mode(0o400)).unwrap();
        let long_ago = SystemTime::now() - Duration::from_hours(1);
        for file in foreign.iter().chain([&orphan]) {
            File::open(file).unwrap().set_modified(long_ago).unwrap();
        }
        let mut orphans = Orphans::default();
        orphans.remove(&world.config);
        assert!(orphan.exists(), "it is seen for the first time");
        later(&mut orphans);
        File::open(&touched)
            .unwrap()
            .set_modified(long_ago)
            .unwrap();
        orphans.remove(&world.config);
        assert!(!orphan.exists());
        assert!(touched.exists() && finished.exists());
        assert!(foreign.iter().all(|file| file.exists()));
    }

    #[test]
    fn what_another_process_is_about_to_remove_stays() {
        let world = World::new();
        let orphan = world.description("a");
        let mut orphans = Orphans::default();
        orphans.remove(&world.config);
        later(&mut orphans);
        let root = world.options.root_path();
        let other = FileLock::take_in(&root, LOCK, "a test").unwrap();
        orphans.remove(&world.config);
        assert!(orphan.exists());
        drop(other);
        orphans.remove(&world.config);
        assert!(!orphan.exists());
    }

    /// A maker that has been stopped is alive, and has its tag.
    #[test]
    fn the_description_of_a_live_maker_stays() {
        let world = World::new();
        let maker = ShmNode::new("maker", &world.options).unwrap();
        let opened = maker.control_subscriber("/topic").unwrap();
        let directory = path(&world.config.global.service_dir());
        let entry = fs::read_dir(directory).unwrap().next().unwrap();
        let description = entry.unwrap().path();
        fs::set_permissions(&description, Permissions::from_mode(UNFINISHED)).unwrap();
        let mut orphans = Orphans::default();
        orphans.remove(&world.config);
        later(&mut orphans);
        orphans.remove(&world.config);
        assert!(description.exists());
        fs::set_permissions(&description, Permissions::from_mode(0o400)).unwrap();
        drop((opened, maker));
        // iceoryx2 keeps a counter there for good.
        let left = fs::read_dir("/dev/shm").into_iter().flatten();
        for entry in left.flatten() {
            let name = entry.file_name();
            if name
                .to_str()
                .is_some_and(|name| name.starts_with(&world.options.prefix()))
            {
                fs::remove_file(entry.path()).unwrap();
            }
        }
    }
}
