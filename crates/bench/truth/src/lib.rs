//! Reference trajectories from independent methods in extended precision, for tests and benchmarks.
//!
//! The files are in `tests/truth` at the workspace's root. A README there describes their origin. [`maneuvers`]
//! generates random problems for the planner, and [`flights`] generates random flights for the choice of an integrator,
//! both by seed and index.

mod double_double;
pub mod flights;
pub mod kepler;
pub mod maneuvers;
pub mod random;

use std::path::PathBuf;

use lgvi_dynamics::gravity::{Central, Gravity, Multipole, Mutual, Uniform};
use lgvi_dynamics::{BodyState, Inertia, PointMass, RigidBody, System};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use thiserror::Error;

/// Flights on which the automatic choice of an integrator is tested and measured: case, duration and number of steps.
pub const RUNS: [(&str, f64, u64); 12] = [
    ("a1_two_dumbbells_regular", 10.0, 100),
    ("a1_two_dumbbells_regular", 30.0, 300),
    ("a1_two_dumbbells_regular", 30.0, 15_000),
    ("d_dumbbell_central", 10.0, 50),
    ("d_dumbbell_central", 30.0, 3_000),
    ("d_dumbbell_central", 100.0, 100),
    ("b1_free_asymmetric", 10.0, 10),
    ("b1_free_asymmetric", 100.0, 10_000),
    ("c1_3d_pendulum", 2.0, 200),
    ("c3_3d_pendulum_regular_small", 20.0, 100),
    ("c3_3d_pendulum_regular_small", 100.0, 1_000),
    ("e_kw4_like", 432_000.0, 120),
];

/// A reference trajectory.
#[derive(Clone, Debug, Deserialize)]
pub struct Case {
    /// Name of the file, without its extension.
    pub case: String,
    potential: String,
    parameters: Parameters,
    bodies: Vec<Body>,
    states: Vec<Reference>,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
struct Parameters {
    #[serde(rename = "G")]
    constant: f64,
    #[serde(rename = "GM")]
    gm: f64,
    g: f64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Body {
    mass: f64,
    #[serde(rename = "J")]
    inertia: [f64; 3],
    #[serde(default)]
    points: Vec<[f64; 4]>,
    #[serde(rename = "rho_c")]
    center: Option<[f64; 3]>,
    x: [f64; 3],
    v: [f64; 3],
    #[serde(rename = "R")]
    attitude: [[f64; 3]; 3],
    #[serde(rename = "Omega")]
    omega: [f64; 3],
}

#[derive(Clone, Debug, Deserialize)]
struct Reference {
    t: f64,
    y: Vec<f64>,
}

/// The reason that a case cannot be loaded or compared.
#[derive(Debug, Error)]
pub enum TruthError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Read {
        /// The path of the file.
        path: PathBuf,
        /// The underlying error.
        source: std::io::Error,
    },
    /// The file does not contain a valid case.
    #[error("{path}: {reason}")]
    Form {
        /// The path of the file.
        path: PathBuf,
        /// A description of the fault.
        reason: String,
    },
    /// The case has no state at the requested time.
    #[error("{case} has no state at t = {t}, but at {times:?}")]
    Time {
        /// Name of the case.
        case: String,
        /// The requested time.
        t: f64,
        /// The available times.
        times: Vec<f64>,
    },
}

/// Largest errors over all bodies, or NaN if any error is NaN.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Error of `x`.
    pub position: f64,
    /// Error of `ẋ`.
    pub velocity: f64,
    /// Error of `R`, Frobenius norm.
    pub attitude: f64,
    /// Error of `Ω`.
    pub angular_velocity: f64,
}

impl Errors {
    /// Returns the largest of the four errors, or NaN if any is NaN.
    pub fn greatest(&self) -> f64 {
        let all = [
            self.position,
            self.velocity,
            self.attitude,
            self.angular_velocity,
        ];
        all.into_iter().fold(0.0, greater)
    }
}

/// Returns the larger of two numbers, or NaN if either is NaN, unlike `f64::max`.
fn greater(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

impl Case {
    /// Loads the case from the file called `name`.
    pub fn load(name: &str) -> Result<Self, TruthError> {
        let path = Self::path(name);
        let text = std::fs::read_to_string(&path).map_err(|source| TruthError::Read {
            path: path.clone(),
            source,
        })?;
        serde_json::from_str(&text).map_err(|error| TruthError::Form {
            path,
            reason: error.to_string(),
        })
    }

    /// Returns the path of the case called `name`.
    pub fn path(name: &str) -> PathBuf {
        let truth = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../tests/truth");
        PathBuf::from(truth).join(name).with_extension("json")
    }

    /// Returns the times of the reference states.
    pub fn times(&self) -> Vec<f64> {
        self.states.iter().map(|state| state.t).collect()
    }

    /// Returns the system of bodies and gravity, and the initial states.
    pub fn system(&self) -> Result<(System, Vec<BodyState>), TruthError> {
        let form = |reason: String| TruthError::Form {
            path: Self::path(&self.case),
            reason,
        };
        let mut bodies = Vec::new();
        let mut states = Vec::new();
        for data in &self.bodies {
            let body = data.body(&self.potential).map_err(&form)?;
            states.push(BodyState::from_velocities(
                &body,
                data.x.into(),
                data.v.into(),
                Matrix3::from_fn(|i, j| data.attitude[i][j]),
                data.omega.into(),
            ));
            bodies.push(body);
        }
        let gravity: Vec<Box<dyn Gravity>> = match self.potential.as_str() {
            "none" => vec![],
            "points" | "macc2" => vec![Box::new(Mutual::new(self.parameters.constant))],
            "central" => vec![Box::new(Central {
                gm: self.parameters.gm,
            })],
            "uniform" => vec![Box::new(Uniform {
                acceleration: Vector3::new(0.0, 0.0, self.parameters.g),
            })],
            other => return Err(form(format!("unknown potential {other:?}"))),
        };
        Ok((System::new(bodies, gravity), states))
    }

    /// Returns the errors of `states` with respect to the reference at `t`.
    pub fn errors(
        &self,
        t: f64,
        bodies: &[RigidBody],
        states: &[BodyState],
    ) -> Result<Errors, TruthError> {
        let reference = self.states.iter().find(|state| state.t == t);
        let reference = reference.ok_or_else(|| TruthError::Time {
            case: self.case.clone(),
            t,
            times: self.times(),
        })?;
        let mut worst = Errors::default();
        let bodies = bodies.iter().zip(states);
        for ((body, state), y) in bodies.zip(reference.y.chunks(18)) {
            let at = |from: usize| Vector3::from_column_slice(&y[from..from + 3]);
            let attitude = Matrix3::from_row_slice(&y[6..15]);
            let keep = |worst: &mut f64, error: f64| *worst = greater(*worst, error);
            keep(&mut worst.position, (state.position - at(0)).norm());
            keep(&mut worst.velocity, (state.velocity(body) - at(3)).norm());
            keep(&mut worst.attitude, (state.attitude - attitude).norm());
            let omega = state.angular_velocity(body);
            keep(&mut worst.angular_velocity, (omega - at(15)).norm());
        }
        Ok(worst)
    }
}

impl Body {
    fn body(&self, potential: &str) -> Result<RigidBody, String> {
        let inertia = Inertia::principal(self.inertia).map_err(|error| error.to_string())?;
        let point = |mass: f64, position: [f64; 3]| PointMass {
            mass,
            position: position.into(),
        };
        let points = self.points.iter().map(|&[m, x, y, z]| point(m, [x, y, z]));
        let body = match (self.center, potential) {
            (Some(center), _) => {
                RigidBody::pivoted(self.mass, inertia, vec![point(self.mass, center)])
            }
            (None, "macc2") => {
                let multipole = Multipole::of_inertia(self.mass, &inertia);
                RigidBody::with_multipole(inertia, multipole)
            }
            (None, _) => RigidBody::new(self.mass, inertia, points.collect()),
        };
        body.map_err(|error| error.to_string())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_state_that_is_no_number_meets_nothing() {
        let case = Case::load("g_kepler").unwrap();
        let (system, mut states) = case.system().unwrap();
        states[0].position.y = f64::NAN;
        let errors = case.errors(1.0, system.bodies(), &states).unwrap();
        assert!(errors.position.is_nan() && errors.greatest().is_nan());
        assert!(errors.velocity.is_finite(), "{errors:?}");
    }
}
