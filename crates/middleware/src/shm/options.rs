//! Which shared memory is used.

use std::{
    env,
    hash::{DefaultHasher, Hash, Hasher},
    path::PathBuf,
};

use iceoryx2::{
    config::Config,
    prelude::{FileName, Path, SemanticString},
};

use super::ShmError;
use crate::Environment;

/// Which shared memory is used: that of a DDS domain, and of a directory if tests want one of their own.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ShmOptions {
    /// The DDS domain, so that nodes that do not see each other over DDS do not see each other here.
    pub domain_id: u16,
    /// Where iceoryx2 keeps its files; its default if `None`. Another directory is another world.
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

    /// The configuration of iceoryx2: the root path, and a prefix of its own for what lies in `/dev/shm`.
    pub(super) fn config(&self) -> Result<Config, ShmError> {
        let mut config = Config::global_config().clone();
        if let Some(root) = &self.root {
            let fail = |reason: String| ShmError::Name {
                what: "LGVI_SHM_ROOT",
                value: root.display().to_string(),
                reason,
            };
            let mut hasher = DefaultHasher::new();
            root.hash(&mut hasher);
            let prefix = format!("lgvi_{:016x}_", hasher.finish());
            config.global.prefix =
                FileName::new(prefix.as_bytes()).map_err(|error| fail(format!("{error:?}")))?;
            let path = Path::new(root.as_os_str().as_encoded_bytes())
                .map_err(|error| fail(format!("{error:?}")))?;
            config.global.set_root_path(&path);
        }
        Ok(config)
    }
}
