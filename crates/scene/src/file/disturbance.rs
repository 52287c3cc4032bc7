use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DisturbanceFile {
    pub seed: u64,
    #[serde(default)]
    pub force_error: f64,
    #[serde(default)]
    pub moment_error: f64,
    #[serde(default)]
    pub position: f64,
    #[serde(default)]
    pub velocity: f64,
    #[serde(default)]
    pub attitude: f64,
    #[serde(default)]
    pub angular_velocity: f64,
}
