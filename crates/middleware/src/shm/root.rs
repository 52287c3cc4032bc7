//! The directory of shared memory.

use std::fs::{self, DirBuilder};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::Path;

use nix::fcntl::{AT_FDCWD, AtFlags};
use nix::unistd::{AccessFlags, Uid, User, faccessat, geteuid};

use super::{ShmError, ShmOptions};

/// Makes the directory where there is none, for its user alone; refuses one that this process cannot use.
pub(super) fn prepare(options: &ShmOptions) -> Result<(), ShmError> {
    let path = options.root_path();
    let fail = |reason: &str| ShmError::Root {
        owner: owner(&path),
        user: user(geteuid()),
        reason: reason.into(),
        path: path.clone(),
    };
    let made = DirBuilder::new().recursive(true).mode(0o700).create(&path);
    made.map_err(|error| fail(&error.to_string()))?;
    // Anybody can make a directory in /tmp, also one of our name.
    let own = || fs::symlink_metadata(&path).is_ok_and(|found| found.uid() == geteuid().as_raw());
    if options.root.is_none() && !own() {
        return Err(fail("it is another user's"));
    }
    let access = AccessFlags::R_OK | AccessFlags::W_OK | AccessFlags::X_OK;
    faccessat(AT_FDCWD, &path, access, AtFlags::AT_EACCESS)
        .map_err(|error| fail(&io::Error::from(error).to_string()))
}

/// Who owns a path, or the nearest directory above that there is.
pub(super) fn owner(path: &Path) -> String {
    let found = path
        .ancestors()
        .find_map(|path| fs::symlink_metadata(path).ok());
    found.map_or_else(|| "nobody".into(), |found| user(Uid::from_raw(found.uid())))
}

/// The user's name, where it has one, and number.
fn user(uid: Uid) -> String {
    match User::from_uid(uid) {
        Ok(Some(user)) => format!("{} (uid {uid})", user.name),
        _ => format!("uid {uid}"),
    }
}
