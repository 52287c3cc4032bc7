//! The types that serde deserializes, key by key, before any validation.

mod body;
mod disturbance;
mod docking;
mod ensemble;
mod frame;
mod maneuver;
mod phase;
mod sensor;

use serde::Deserialize;

pub(crate) use body::{
    AttitudeFile, BodyFile, ElementsFile, EngineFile, InertiaFile, MobilityFile, MultipoleFile,
    PointFile, PolyhedronFile, PropellantFile, RelativeFile, ThrusterFile, WheelFile,
};
pub(crate) use disturbance::{DisturbanceFile, DisturbedBodyFile};
pub(crate) use docking::{DockingFile, PortFile};
pub(crate) use ensemble::{EnsembleFile, SpreadFile};
pub(crate) use frame::FrameFile;
pub(crate) use maneuver::{
    ActuatorFile, CommandsFile, CompanionFile, CostFile, DynamicsFile, EachFile, FinalTimeFile,
    ManeuverFile, MinimizeFile, MotionFile, ReplanFile, SearchFile, SolverFile, SolverMethodFile,
    TargetFile, WeightFile,
};

pub(crate) use phase::{OffFile, PhaseDurationFile, PhaseFile};
pub(crate) use sensor::{ExclusionFile, InertialErrorsFile, SensorFile};

use crate::chosen::ChosenFile;
use crate::gravity::GravityFile;
use crate::integrator::{IntegratorFile, SkipFile};

/// A flight: units, run, gravity, bodies, maneuver. Numbers are in the scene's own units.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(title = "Scene of lgvi"))]
#[serde(deny_unknown_fields)]
pub(crate) struct SceneFile {
    /// The choice of the integrator "auto"; the propagator writes it at the top of the scene that it flies.
    pub chosen: Option<ChosenFile>,
    /// Title of the scene.
    pub title: String,
    /// Units of the numbers of the scene.
    #[serde(default)]
    pub units: UnitsFile,
    /// Name of the inertial frame.
    #[serde(default = "inertial")]
    pub frame: String,
    /// Duration, steps and integrator.
    pub run: RunFile,
    /// Intervals of publication.
    #[serde(default)]
    pub publish: PublishFile,
    /// Fields that act together on the bodies.
    #[serde(default)]
    pub gravity: GravityFile,
    /// The bodies, 1 to 1024.
    pub bodies: Vec<BodyFile>,
    /// Additional frames, such as docking ports, cameras or thrusters.
    #[serde(default)]
    pub frames: Vec<FrameFile>,
    /// Pairs of ports at which bodies join.
    #[serde(default)]
    pub docking: Vec<DockingFile>,
    /// A maneuver of one free body, or of several together, planned over the run.
    pub maneuver: Option<ManeuverFile>,
    /// Deviations of the maneuver's flight from its plan.
    pub disturbance: Option<DisturbanceFile>,
    /// Dispersion of the samples of `lgvi ensemble`.
    pub ensemble: Option<EnsembleFile>,
}

fn inertial() -> String {
    "inertial".into()
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct UnitsFile {
    /// Unit of length: a number with m, km or au, such as "7000 km".
    pub length: String,
    /// Unit of mass: a number with kg, g or t.
    pub mass: String,
    /// Unit of time: a number with s, min, h or d.
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
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct RunFile {
    /// Time of step 0, with offset; 2000-01-01T12:00:00Z by default.
    #[cfg_attr(test, schemars(with = "Option<String>"))]
    pub epoch: Option<toml::value::Datetime>,
    /// Duration of the run.
    pub duration: f64,
    /// Number of steps of the run.
    pub steps: u64,
    /// Name of an integrator, or a table with its name and options.
    pub integrator: IntegratorFile,
    /// Steps of the integrator per step of the run: 1 by default; not with "auto".
    pub substeps: Option<u32>,
    /// How often a step that fails may be halved, up to 20.
    #[serde(default)]
    pub subdivide: u32,
    /// Terms to skip: "nothing", "exact" (those that change only rounding), or { tolerance = 1e-9 }.
    pub skip: Option<SkipFile>,
    /// Seed of the errors of all sensors that have no `seed` of their own.
    #[serde(default)]
    pub sensor_seed: u64,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct PublishFile {
    /// Steps between two states in shared memory.
    pub state_every: u64,
    /// Steps between two sets of ROS messages.
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
