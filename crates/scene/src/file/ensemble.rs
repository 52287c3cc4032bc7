use serde::Deserialize;

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct EnsembleFile {
    /// Number of samples, 1 to 10¹⁰ − 1.
    pub samples: u64,
    /// Seed; together with its index it determines a sample.
    pub seed: u64,
    /// Standard deviation of a constant relative error of each component of the force; only with a maneuver.
    #[serde(default)]
    pub force_error: f64,
    /// Standard deviation of a constant relative error of each component of the moment; only with a maneuver.
    #[serde(default)]
    pub moment_error: f64,
    /// Standard deviation of a constant relative error of each thruster or reaction wheel that `maneuver` commands.
    #[serde(default)]
    pub actuator_error: f64,
    /// The dispersed bodies.
    #[serde(default)]
    pub bodies: Vec<SpreadFile>,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct SpreadFile {
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
    /// Standard deviation of the logarithm of the mass, at most 2; not for a polyhedron.
    #[serde(default)]
    pub mass: f64,
    /// Standard deviation of the logarithm of each moment `∫ρ_i² dm`, at most 2.
    #[serde(default)]
    pub inertia: f64,
}
