//! CasADi's solvers, in a Python process that lives as long as a problem is compared.

use std::time::Duration;

use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Load};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::case::Case;
use super::guess;
use crate::error::BenchError;
use crate::peer::{CASADI, Process, Python};

/// A solver as the script knows it.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Solver {
    #[serde(skip)]
    pub label: &'static str,
    solver: &'static str,
    unknowns: &'static str,
    compiled: bool,
    tolerance: Option<f64>,
}

/// Tolerance at which costs can be compared to nine digits.
const TIGHT: Option<f64> = Some(1e-12);

/// What is compared. At their default tolerance the steps of momenta and states leave violations at rounding; a tighter
/// one only has their solvers end without progress.
pub(crate) const SOLVERS: [Solver; 6] = [
    Solver::new(
        "IPOPT, controls, interpreted",
        "ipopt",
        "controls",
        false,
        None,
    ),
    Solver::new("IPOPT, controls", "ipopt", "controls", true, None),
    Solver::new("IPOPT, controls, 1e-12", "ipopt", "controls", true, TIGHT),
    Solver::new("IPOPT, states", "ipopt", "states", true, None),
    Solver::new("fatrop, controls", "fatrop", "controls", true, None),
    Solver::new("fatrop, momenta", "fatrop", "momenta", true, None),
];

/// What a solve of a peer gave.
#[derive(Debug, Deserialize)]
pub(crate) struct Found {
    pub seconds: f64,
    pub wall: f64,
    pub iterations: u32,
    pub success: bool,
    pub status: String,
    pub cost: f64,
    controls: Vec<[f64; 6]>,
}

impl Solver {
    const fn new(
        label: &'static str,
        solver: &'static str,
        unknowns: &'static str,
        compiled: bool,
        tolerance: Option<f64>,
    ) -> Self {
        Self {
            label,
            solver,
            unknowns,
            compiled,
            tolerance,
        }
    }
}

impl Found {
    pub(crate) fn controls(&self) -> Vec<Load> {
        let load = |u: &[f64; 6]| Load {
            force: [u[0], u[1], u[2]].into(),
            moment: [u[3], u[4], u[5]].into(),
        };
        self.controls.iter().map(load).collect()
    }
}

/// How long a problem may take to be built and compiled for all solvers, and then to be solved by one.
const BUILDING: Duration = Duration::from_secs(900);
const SOLVING: Duration = Duration::from_secs(180);

/// The running process.
pub(crate) struct Casadi(Process);

#[derive(Deserialize)]
struct Built {
    build_seconds: Vec<f64>,
}

impl Casadi {
    pub(crate) fn start(python: &Python) -> Result<Self, BenchError> {
        Ok(Self(Process::start(python, CASADI)?))
    }

    /// States the problem to all solvers; the seconds that each took to get ready.
    pub(crate) fn build(&mut self, case: &Case) -> Result<Vec<f64>, BenchError> {
        let request = json!({"build": problem(case)?, "solvers": SOLVERS});
        let built: Built = self.0.ask(&request, BUILDING)?;
        Ok(built.build_seconds)
    }

    /// Solves from the guess with the solver of this index.
    pub(crate) fn solve(&mut self, solver: usize, controls: bool) -> Result<Found, BenchError> {
        let request = json!({"solve": solver, "controls": controls});
        self.0.ask(&request, SOLVING)
    }
}

/// The problem and the guess as the script reads them.
fn problem(case: &Case) -> Result<Value, BenchError> {
    let (named, maneuver, target) = (case.body()?, case.maneuver()?, case.target()?);
    let (body, h) = (&named.body, case.scene.h());
    let field = Central {
        gm: case.attractor()?.gm,
    };
    let steps = case.scene.steps as usize;
    let guess = guess::cold(body, &field, h, steps, &named.state, &target);
    let weight = maneuver.actuation.weight();
    let weights = [0, 3].map(|first| rows(&weight.fixed_view::<3, 3>(first, first).into_owned()));
    let points = body.points().iter();
    let points: Vec<_> = points
        .map(|point| {
            json!([
                point.mass,
                point.position.x,
                point.position.y,
                point.position.z
            ])
        })
        .collect();
    let control = |u: &Load| {
        [
            u.force.x, u.force.y, u.force.z, u.moment.x, u.moment.y, u.moment.z,
        ]
    };
    Ok(json!({
        "h": h,
        "mass": body.mass(),
        "gm": field.gm,
        "inertia": rows(body.inertia().matrix()),
        "points": points,
        "weights": weights,
        "initial": state(&named.state),
        "target": state(&target),
        "guess": {
            "states": guess.states.iter().map(state).collect::<Vec<_>>(),
            "controls": guess.controls.iter().map(control).collect::<Vec<_>>(),
        },
    }))
}

fn state(state: &BodyState) -> Value {
    json!({
        "x": state.position.as_slice(),
        "gamma": state.linear_momentum.as_slice(),
        "R": rows(&state.attitude),
        "Pi": state.angular_momentum.as_slice(),
    })
}

fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
}
