//! The file's form: what serde reads, key by key, before anything is checked.

use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SceneFile {
    pub title: String,
    #[serde(default)]
    pub units: UnitsFile,
    #[serde(default = "inertial")]
    pub frame: String,
    pub run: RunFile,
    #[serde(default)]
    pub publish: PublishFile,
    #[serde(default)]
    pub gravity: GravityFile,
    pub bodies: Vec<BodyFile>,
    pub maneuver: Option<ManeuverFile>,
}

fn inertial() -> String {
    "inertial".into()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct UnitsFile {
    pub length: String,
    pub mass: String,
    pub time: String,
}

impl Default for UnitsFile {
    fn default() -> Self {
        Self {
            length: "1 m".into(),
            mass: "1 kg".into(),
            time: "1 s".into(),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RunFile {
    pub epoch: Option<toml::value::Datetime>,
    pub duration: f64,
    pub steps: u64,
    pub integrator: IntegratorFile,
    #[serde(default)]
    pub chart: ChartFile,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum IntegratorFile {
    Lgvi,
    LieEuler,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ChartFile {
    #[default]
    Cayley,
    Exponential,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct PublishFile {
    pub state_every: u64,
    pub ros_every: u64,
}

impl Default for PublishFile {
    fn default() -> Self {
        Self {
            state_every: 1,
            ros_every: 10,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct GravityFile {
    pub central: Option<CentralFile>,
    pub mutual: Option<MutualFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CentralFile {
    pub gm: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MutualFile {
    pub constant: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BodyFile {
    pub name: String,
    pub mass: f64,
    pub inertia: InertiaFile,
    #[serde(default)]
    pub points: Vec<PointFile>,
    pub position: [f64; 3],
    pub velocity: [f64; 3],
    pub attitude: AttitudeFile,
    pub angular_velocity: [f64; 3],
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected three principal moments or a 3×3 matrix"
)]
pub(crate) enum InertiaFile {
    Principal([f64; 3]),
    Matrix([[f64; 3]; 3]),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PointFile {
    pub mass: f64,
    pub position: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TargetFile {
    pub position: [f64; 3],
    pub velocity: [f64; 3],
    pub attitude: AttitudeFile,
    pub angular_velocity: [f64; 3],
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a 3×3 rotation matrix by rows, or a quaternion { w, x, y, z }"
)]
pub(crate) enum AttitudeFile {
    Matrix([[f64; 3]; 3]),
    Quaternion(QuaternionFile),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct QuaternionFile {
    pub w: f64,
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

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
