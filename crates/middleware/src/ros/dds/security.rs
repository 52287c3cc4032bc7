//! How a participant joins a domain with DDS Security.

use rustdds::{DomainParticipant, DomainParticipantBuilder};
use tracing::{info, warn};

use super::descriptors;
use crate::{Environment, NodeArgs, ros::RosError, security::Enclave};

/// The enclave that a node is to join with; none without security.
pub(super) fn enclave(
    args: &NodeArgs,
    environment: &Environment,
) -> Result<Option<Enclave>, RosError> {
    let enclave = environment.security.enclave(args.enclave(), |error| {
        warn!("joining without security because ROS_SECURITY_STRATEGY is Permissive: {error}");
    })?;
    if let Some(Enclave {
        name, directory, ..
    }) = &enclave
    {
        info!(enclave = name, "DDS security by {}", directory.display());
    }
    if let Some(exposed) = enclave.as_ref().filter(|enclave| enclave.exposed) {
        warn!(
            "other users may read the private key {}: chmod 600",
            exposed.directory.join("key.pem").display()
        );
    }
    Ok(enclave)
}

/// Joins, with the enclave's files if there is one.
pub(super) fn join(
    builder: DomainParticipantBuilder,
    enclave: Option<&Enclave>,
) -> Result<DomainParticipant, String> {
    descriptors::spare(descriptors::PARTICIPANT).map_err(|error| error.to_string())?;
    let Some(enclave) = enclave else {
        return builder.build().map_err(|error| error.to_string());
    };
    secured(builder, enclave).map_err(|error| {
        let directory = enclave.directory.display();
        format!("enclave {:?} in {directory}: {error}", enclave.name)
    })
}

#[cfg(feature = "security")]
fn secured(
    builder: DomainParticipantBuilder,
    enclave: &Enclave,
) -> Result<DomainParticipant, String> {
    use rustdds::DomainParticipantSecurityConfigFiles as Files;
    let no_password = String::new();
    let files = Files::with_ros_default_names(&enclave.directory, no_password);
    let joined = builder.builtin_security(files).build();
    joined.map_err(|error| error.to_string())
}

/// [`Security::enclave`](crate::Security) finds none.
#[cfg(not(feature = "security"))]
fn secured(_: DomainParticipantBuilder, _: &Enclave) -> Result<DomainParticipant, String> {
    Err(crate::SecurityError::NotBuilt.to_string())
}
