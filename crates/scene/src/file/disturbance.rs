use serde::Deserialize;

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct DisturbanceFile {
    /// Seed of all deviations.
    pub seed: u64,
    /// Standard deviation of a constant relative error of each component of the force, inertial axes.
    #[serde(default)]
    pub force_error: f64,
    /// Standard deviation of a constant relative error of each component of the moment, body axes.
    #[serde(default)]
    pub moment_error: f64,
    /// Standard deviation of a constant relative error of each thruster or reaction wheel that `maneuver` commands.
    #[serde(default)]
    pub actuator_error: f64,
    /// Standard deviation of each component of the initial position.
    #[serde(default)]
    pub position: f64,
    /// Standard deviation of each component of the initial velocity.
    #[serde(default)]
    pub velocity: f64,
    /// Standard deviation of each component of the initial attitude's rotation vector (rad), at most π.
    #[serde(default)]
    pub attitude: f64,
    /// Standard deviation of each component of the initial angular velocity, body frame (rad per unit of time).
    #[serde(default)]
    pub angular_velocity: f64,
    /// Deviations of other bodies.
    #[serde(default)]
    pub bodies: Vec<DisturbedBodyFile>,
}

/// Standard deviations of the initial state of another body than that of `maneuver`.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct DisturbedBodyFile {
    /// Name of the body.
    pub body: String,
    /// Standard deviation of each component of the initial position.
    #[serde(default)]
    pub position: f64,
    /// Standard deviation of each component of the initial velocity.
    #[serde(default)]
    pub velocity: f64,
    /// Standard deviation of each component of the initial attitude's rotation vector (rad), at most π.
    #[serde(default)]
    pub attitude: f64,
    /// Standard deviation of each component of the initial angular velocity, body frame (rad per unit of time).
    #[serde(default)]
    pub angular_velocity: f64,
}
