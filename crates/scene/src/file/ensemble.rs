use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EnsembleFile {
    pub samples: u64,
    pub seed: u64,
    #[serde(default)]
    pub force_error: f64,
    #[serde(default)]
    pub moment_error: f64,
    #[serde(default)]
    pub bodies: Vec<SpreadFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SpreadFile {
    pub body: String,
    #[serde(default)]
    pub position: f64,
    #[serde(default)]
    pub velocity: f64,
    #[serde(default)]
    pub attitude: f64,
    #[serde(default)]
    pub angular_velocity: f64,
    #[serde(default)]
    pub mass: f64,
    #[serde(default)]
    pub inertia: f64,
}
