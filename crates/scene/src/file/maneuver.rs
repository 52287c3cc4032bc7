use serde::Deserialize;

use super::AttitudeFile;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ManeuverFile {
    pub body: String,
    #[serde(default)]
    pub force_weight: WeightFile,
    #[serde(default)]
    pub moment_weight: WeightFile,
    #[serde(default)]
    pub solver: SolverFile,
    pub target: TargetFile,
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number, three numbers or a 3×3 matrix"
)]
pub(crate) enum WeightFile {
    Scalar(f64),
    Diagonal([f64; 3]),
    Matrix([[f64; 3]; 3]),
}

impl Default for WeightFile {
    fn default() -> Self {
        Self::Scalar(1.0)
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct SolverFile {
    pub tolerance: Option<f64>,
    pub max_iterations: Option<u32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TargetFile {
    pub position: [f64; 3],
    pub velocity: [f64; 3],
    pub attitude: AttitudeFile,
    pub angular_velocity: [f64; 3],
}
