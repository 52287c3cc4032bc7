//! Which shared memory is used.

use std::{env, path::PathBuf};

use iceoryx2::{
    config::Config,
    prelude::{FileName, Path, SemanticString},
};
use nix::unistd::geteuid;
use sha2::{Digest, Sha256};

use super::{ShmError, root};
use crate::Environment;

/// Which shared memory is used: that of a DDS domain, and of a directory.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ShmOptions {
    /// The DDS domain, so that nodes that do not see each other over DDS do not see each other here.
    pub domain_id: u16,
    /// Where iceoryx2 keeps its files; `None`: the user's own directory. Another directory is another world.
    pub root: Option<PathBuf>,
}

impl ShmOptions {
    /// The domain of the environment, and the directory that `LGVI_SHM_ROOT` names, if it does.
    pub fn from_env(environment: &Environment) -> Self {
        Self {
            domain_id: environment.domain_id,
            root: env::var_os("LGVI_SHM_ROOT")
                .filter(|root| !root.is_empty())
                .map(Into::into),
        }
    }

    /// The directory: [`root`](Self::root), or `/tmp/lgvi_<uid>`.
    ///
    /// Not in `XDG_RUNTIME_DIR`, which a service or a job of the same user lacks: it would not see that user's other nodes.
    pub fn root_path(&self) -> PathBuf {
        let own = || format!("/tmp/lgvi_{}", geteuid()).into();
        self.root.clone().unwrap_or_else(own)
    }

    /// The same, made for its user alone where it is missing.
    ///
    /// # Errors
    /// If it is another user's, or this process cannot use it.
    pub fn prepared_root(&self) -> Result<PathBuf, ShmError> {
        root::prepare(self)?;
        Ok(self.root_path())
    }

    /// What the names of all files of the directory begin with, in it and in `/dev/shm`: `lgvi_`, the first 16 hexadecimal
    /// digits of the SHA-256 of the directory's path without trailing slashes, and `_`.
    ///
    /// A process in another language sets its iceoryx2 configuration's root path and prefix to these two.
    pub fn prefix(&self) -> String {
        let root = self.root_path();
        let root = root.as_os_str().as_encoded_bytes();
        let slashes = root.iter().rev().take_while(|&&byte| byte == b'/').count();
        let digest = Sha256::digest(&root[..root.len() - slashes]);
        let digits: String = digest[..8]
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        format!("lgvi_{digits}_")
    }

    /// The configuration of iceoryx2: the root path, and a prefix of its own for what lies in `/dev/shm`.
    pub(super) fn config(&self) -> Result<Config, ShmError> {
        let root = self.root_path();
        let fail = |reason: String| ShmError::Name {
            what: "LGVI_SHM_ROOT",
            value: root.display().to_string(),
            reason,
        };
        let mut config = Config::global_config().clone();
        config.global.prefix =
            FileName::new(self.prefix().as_bytes()).map_err(|error| fail(format!("{error:?}")))?;
        let path = Path::new(root.as_os_str().as_encoded_bytes())
            .map_err(|error| fail(format!("{error:?}")))?;
        config.global.set_root_path(&path);
        Ok(config)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prefix(root: &str) -> String {
        let options = ShmOptions {
            root: Some(root.into()),
            ..ShmOptions::default()
        };
        options.prefix()
    }

    #[test]
    fn the_prefix_is_what_another_language_computes() {
        // printf /tmp/lgvi | sha256sum | cut -c1-16
        let expected = "lgvi_6a0d605a6dafe7ba_".to_owned();
        assert_eq!(prefix("/tmp/lgvi"), expected);
        assert_eq!(prefix("/tmp/lgvi//"), expected);
    }
}
