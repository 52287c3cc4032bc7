//! Scene files: what a user writes in TOML, validated and compiled to what is flown.
//!
//! [`Scene::parse`] takes the text and either returns a [`Scene`] that can be flown or a [`SceneError`] that names the
//! key, the value and what was expected. Numbers stay in the scene's own units; [`Units`] converts what leaves to SI and
//! what comes back.

mod check;
mod compile;
mod discretisation;
mod disturbance;
mod ensemble;
mod error;
mod file;
mod frame;
mod gravity;
mod integrator;
mod maneuver;
mod miss;
mod numbers;
mod resolution;
mod scene;
mod shape;
mod units;

pub use disturbance::{ActuatorErrors, Disturbance};
pub use ensemble::{Deviation, Ensemble, Sample, Spread};
pub use error::{LONGEST, SceneError, SchemeError};
pub use frame::Frame;
pub use gravity::{CentralAttractor, Oblateness, SceneGravity};
pub use integrator::{Integration, Scheme, Skipping};
pub use maneuver::{FinalTime, Maneuver, Replan, Search, Solver, SolverMethod};
pub use resolution::{Energies, Rates};
pub use scene::{NamedBody, Publishing, Scene};
pub use shape::Shape;
pub use units::Units;
