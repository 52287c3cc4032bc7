//! Scene files: descriptions in TOML, validated and compiled for the simulation.
//!
//! ```
//! use lgvi_dynamics::Load;
//! use lgvi_scene::Scene;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = r#"
//!     title = "Free body"
//!     run = { duration = 10.0, steps = 1000, integrator = "lgvi" }
//!
//!     [[bodies]]
//!     name = "satellite"
//!     mass = 100.0
//!     inertia = [10.0, 20.0, 25.0]
//!     position = [0.0, 0.0, 0.0]
//!     velocity = [0.0, 0.0, 0.0]
//!     attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
//!     angular_velocity = [0.0, 0.5, 0.01]
//! "#;
//! let scene = Scene::parse("free_body", text)?;
//! let mut simulation = scene.simulation(scene.scheme()?)?;
//! let before = simulation.invariants().angular_momentum;
//! for _ in 0..1000 {
//!     simulation.advance(&[Load::default()])?;
//! }
//! assert!((simulation.invariants().angular_momentum - before).norm() < 1e-12);
//!
//! let error = Scene::parse("free_body", &text.replace("mass = 100.0", "mass = -1.0")).unwrap_err();
//! assert!(error.to_string().contains("mass"));
//! # Ok(())
//! # }
//! ```
//!
//! [`Scene::parse`] takes the text and returns a [`Scene`] that can be flown, or a [`SceneError`] that names the key,
//! the value and the expected values. Numbers stay in the scene's own units. [`Units`] converts outputs to SI and
//! inputs back.

mod angle;
mod axes;
mod check;
mod chosen;
mod compile;
mod discretization;
mod disturbance;
mod ensemble;
mod error;
mod file;
mod frame;
mod gravity;
mod integrator;
mod maneuver;
mod miss;
mod mount;
mod noise;
mod numbers;
mod orbit;
mod phase;
mod position;
mod resolution;
mod scene;
mod schema;
mod sensor;
mod shape;
mod suggestion;
mod units;

pub use check::{quaternion_defect, rotation_defect};
pub use chosen::Chosen;
pub use compile::{MAX_THRUSTERS, MAX_WHEELS, Seen};
pub use disturbance::{ActuatorErrors, Disturbance, StateDeviation};
pub use ensemble::{Deviation, Ensemble, Sample, Spread};
pub use error::{LONGEST, SceneError, SchemeError};
pub use frame::Frame;
pub use gravity::{CentralAttractor, Oblateness, SceneGravity};
pub use integrator::{Integration, Scheme, Skipping};
pub use maneuver::{Commands, FinalTime, Maneuver, Minimize, Replan, Search, Solver, SolverMethod};
pub use mount::Mount;
pub use noise::{Process, Stream};
pub use phase::{Phase, Stated};
pub use resolution::{Energies, Rates};
pub use scene::{NamedBody, Publishing, Scene};
pub use schema::SCHEMA;
pub use sensor::{
    Exclusion, Gnss, Imu, InertialErrors, RelativePose, SensitivityErrors, Sensor, SensorKind,
    StarTracker, Toward,
};
pub use shape::Shape;
pub use units::Units;
