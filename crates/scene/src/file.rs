//! The types that serde deserializes, key by key, before any validation.

mod body;
mod disturbance;
mod ensemble;
mod frame;
mod maneuver;

use serde::Deserialize;

pub(crate) use body::{
    AttitudeFile, BodyFile, InertiaFile, MobilityFile, MultipoleFile, PointFile, PolyhedronFile,
};
pub(crate) use disturbance::DisturbanceFile;
pub(crate) use ensemble::{EnsembleFile, SpreadFile};
pub(crate) use frame::FrameFile;
pub(crate) use maneuver::{
    ActuatorFile, DynamicsFile, FinalTimeFile, ManeuverFile, MotionFile, ReplanFile, SearchFile,
    SolverFile, SolverMethodFile, TargetFile, WeightFile,
};

use crate::chosen::ChosenFile;
use crate::gravity::GravityFile;
use crate::integrator::{IntegratorFile, SkipFile};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SceneFile {
    pub chosen: Option<ChosenFile>,
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
    #[serde(default)]
    pub frames: Vec<FrameFile>,
    pub maneuver: Option<ManeuverFile>,
    pub disturbance: Option<DisturbanceFile>,
    pub ensemble: Option<EnsembleFile>,
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
    pub substeps: Option<u32>,
    #[serde(default)]
    pub subdivide: u32,
    pub skip: Option<SkipFile>,
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
