use std::path::PathBuf;

use lgvi_middleware::Parameters;

use lgvi_middleware::node::NodeError;

/// The path in a parameter whose default is the empty string.
///
/// # Errors
/// It was not given.
pub fn required_path(parameters: &Parameters, name: &str) -> Result<PathBuf, NodeError> {
    let path: String = parameters.get(name)?;
    if path.is_empty() {
        return Err(NodeError::Input(format!(
            "parameter {name:?} is missing, expected a path"
        )));
    }
    Ok(path.into())
}

/// Whether a node with the parameter `clock` publishes `/clock`.
///
/// # Errors
/// It is to follow that clock too.
pub fn publishes_clock(parameters: &Parameters) -> Result<bool, NodeError> {
    let clock = parameters.get("clock")?;
    if clock && parameters.get("use_sim_time")? {
        return Err(NodeError::Input(
            "parameters \"clock\" and \"use_sim_time\" are both true, expected one at most: \
             the node would follow itself"
                .into(),
        ));
    }
    Ok(clock)
}
