//! One flight a domain: the nodes of two would hear each other.

use std::path::Path;

use lgvi_middleware::Environment;
use lgvi_middleware::node::{FileLock, LockError, NodeError};

/// Takes the domain for a flight of `scene` into `bag`, unless another flight is under way there.
pub(crate) fn lock(scene: &Path, bag: &Path) -> Result<FileLock, NodeError> {
    let environment = Environment::from_env().map_err(NodeError::input)?;
    let flight = format!("{} into {}", scene.display(), bag.display());
    FileLock::take(&environment, "domain", &flight).map_err(|error| match error {
        LockError::Held(other) => NodeError::Input(format!(
            "domain {} has a flight under way ({other}), \
             expected none: wait for its end, or set another ROS_DOMAIN_ID",
            environment.domain_id
        )),
        error => NodeError::runtime(error),
    })
}
