//! One flight a domain: the nodes of two would hear each other.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use lgvi_middleware::Environment;
use lgvi_middleware::shm::ShmOptions;
use lgvi_node::NodeError;

/// The right to fly in this process's domain. It ends with this value, or with the process, however that ends.
#[derive(Debug)]
pub(crate) struct DomainLock {
    _file: File,
}

impl DomainLock {
    /// Takes the domain for a flight of `scene` into `bag`, unless another flight is under way there.
    pub(crate) fn take(scene: &Path, bag: &Path) -> Result<Self, NodeError> {
        let environment = Environment::from_env().map_err(NodeError::input)?;
        let root = ShmOptions::from_env(&environment).root;
        let domain = environment.domain_id;
        let directory = root.unwrap_or_else(std::env::temp_dir);
        let path = directory.join(format!("lgvi_domain_{domain}.lock"));
        let fail = |error: &dyn std::fmt::Display| {
            NodeError::Runtime(format!("cannot lock {}: {error}", path.display()))
        };
        let mut file = open(&path, &directory).map_err(|error| fail(&error))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let mut other = String::new();
                // Who it is is good to know, but changes nothing.
                let _ = file.read_to_string(&mut other);
                let other = if other.is_empty() { "unknown" } else { &other };
                return Err(NodeError::Input(format!(
                    "domain {domain} has a flight under way ({other}), \
                     expected none: wait for its end, or set another ROS_DOMAIN_ID"
                )));
            }
            Err(TryLockError::Error(error)) => return Err(fail(&error)),
        }
        // For others to read; a file of another user holds what that one has written.
        let pid = std::process::id();
        let (scene, bag) = (scene.display(), bag.display());
        let _ = file
            .set_len(0)
            .and_then(|()| write!(file, "process {pid}: {scene} into {bag}"));
        Ok(Self { _file: file })
    }
}

/// Opens the file, which stays: to remove it would give the next two flights a file each.
fn open(path: &PathBuf, directory: &Path) -> io::Result<File> {
    std::fs::create_dir_all(directory)?;
    let options = || {
        let mut options = OpenOptions::new();
        options.read(true).custom_flags(nix::libc::O_NOFOLLOW);
        options
    };
    match options()
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)
    {
        // Another user's: it can be locked all the same.
        Err(error) if error.kind() == ErrorKind::PermissionDenied => options().open(path),
        opened => opened,
    }
}
