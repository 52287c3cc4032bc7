use serde::Deserialize;

use super::AttitudeFile;
use crate::compile::ConstraintFile;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ManeuverFile {
    pub body: String,
    pub dynamics: Option<DynamicsFile>,
    #[serde(default)]
    pub processed: bool,
    #[serde(default)]
    pub motion: MotionFile,
    pub force_weight: Option<WeightFile>,
    pub moment_weight: Option<WeightFile>,
    pub actuators: Option<Vec<ActuatorFile>>,
    #[serde(default)]
    pub constraints: Vec<ConstraintFile>,
    pub final_time: Option<FinalTimeFile>,
    pub search: Option<SearchFile>,
    pub replan: Option<ReplanFile>,
    #[serde(default)]
    pub feedback: bool,
    #[serde(default)]
    pub solver: SolverFile,
    pub target: TargetFile,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum DynamicsFile {
    LieEuler,
    Lgvi,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum MotionFile {
    #[default]
    Full,
    Translation,
    Rotation,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number, three numbers or a 3×3 matrix"
)]
pub(crate) enum WeightFile {
    Scalar(f64),
    Diagonal([f64; 3]),
    Matrix([[f64; 3]; 3]),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ActuatorFile {
    #[serde(default)]
    pub force: [f64; 3],
    #[serde(default)]
    pub moment: [f64; 3],
    #[serde(default = "one")]
    pub weight: f64,
}

fn one() -> f64 {
    1.0
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FinalTimeFile {
    pub min: f64,
    pub max: Option<f64>,
    #[serde(default)]
    pub weight: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SearchFile {
    pub starts: u32,
    #[serde(default)]
    pub seed: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ReplanFile {
    pub every: u64,
    pub deadline: f64,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct SolverFile {
    pub method: SolverMethodFile,
    pub tolerance: Option<f64>,
    pub max_iterations: Option<u32>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum SolverMethodFile {
    #[default]
    Newton,
    Shooting,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TargetFile {
    pub position: Option<[f64; 3]>,
    pub velocity: Option<[f64; 3]>,
    pub orbit: Option<OrbitFile>,
    pub attitude: Option<AttitudeFile>,
    pub spin_axis: Option<SpinAxisFile>,
    pub angular_velocity: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct OrbitFile {
    pub position: [f64; 3],
    pub velocity: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SpinAxisFile {
    pub axis: [f64; 3],
    pub direction: [f64; 3],
}
