//! The keystore of SROS 2: who the node is, and what it may do.

use std::path::Path;

use rustdds::DomainParticipantBuilder;
use tracing::warn;

use crate::{SecuritySettings, SecurityStrategy};

/// The files of an enclave, by the names of `rmw_dds_common`.
#[cfg(feature = "security")]
const FILES: [&str; 6] = [
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
];

/// Secures a participant where the settings ask for it.
pub(super) fn secured(
    builder: DomainParticipantBuilder,
    settings: Option<&SecuritySettings>,
    enclave: &str,
) -> Result<DomainParticipantBuilder, String> {
    let Some(settings) = settings else {
        return Ok(builder);
    };
    match (found(settings, enclave), settings.strategy) {
        (Ok(directory), _) => with_keystore(builder, Path::new(&directory)),
        (Err(reason), SecurityStrategy::Enforce) => Err(reason),
        (Err(reason), SecurityStrategy::Permissive) => {
            warn!("{reason}: the node is not secured (ROS_SECURITY_STRATEGY=Permissive)");
            Ok(builder)
        }
    }
}

#[cfg(feature = "security")]
fn with_keystore(
    builder: DomainParticipantBuilder,
    directory: &Path,
) -> Result<DomainParticipantBuilder, String> {
    use rustdds::DomainParticipantSecurityConfigFiles as Files;
    let files = Files::with_ros_default_names(directory, String::new());
    Ok(builder.builtin_security(files))
}

#[cfg(not(feature = "security"))]
fn with_keystore(
    _: DomainParticipantBuilder,
    _: &Path,
) -> Result<DomainParticipantBuilder, String> {
    Err(NOT_BUILT.into())
}

#[cfg(not(feature = "security"))]
const NOT_BUILT: &str =
    "ROS_SECURITY_ENABLE is true, which needs a program built with the cargo feature security";

/// The directory of the enclave, of which all files can be read.
#[cfg(feature = "security")]
fn found(settings: &SecuritySettings, enclave: &str) -> Result<String, String> {
    let keystore = settings
        .keystore
        .as_ref()
        .ok_or("ROS_SECURITY_ENABLE is true and ROS_SECURITY_KEYSTORE is unset")?;
    let enclave = settings.enclave_override.as_deref().unwrap_or(enclave);
    let directory = Path::new(keystore)
        .join("enclaves")
        .join(enclave.trim_matches('/'));
    for file in FILES {
        let path = directory.join(file);
        std::fs::File::open(&path).map_err(|error| {
            let path = path.display();
            format!("ROS_SECURITY_KEYSTORE={keystore}, enclave {enclave}: {path}: {error}")
        })?;
    }
    governed(&directory.join("governance.p7s"))?;
    Ok(directory.display().to_string())
}

/// Refuses what RustDDS 0.15.1 cannot keep: it does not decrypt the payloads that it has encrypted by themselves.
#[cfg(feature = "security")]
fn governed(path: &Path) -> Result<(), String> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let text = String::from_utf8_lossy(&bytes);
    let mut kinds = text.split("<data_protection_kind>").skip(1);
    if kinds.all(|kind| kind.trim_start().starts_with("NONE")) {
        return Ok(());
    }
    Err(format!(
        "{}: data_protection_kind must be NONE: RustDDS 0.15 cannot read payloads that are protected by themselves; \
         metadata_protection_kind ENCRYPT encrypts them too",
        path.display()
    ))
}

#[cfg(not(feature = "security"))]
fn found(_: &SecuritySettings, _: &str) -> Result<String, String> {
    Err(NOT_BUILT.into())
}
