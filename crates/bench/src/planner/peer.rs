//! CasADi's solvers, in a Python process that lives as long as problems are compared.

use std::time::Duration;

use lgvi_control::constraint::{Corridor, KeepOutCone, KeepOutSphere, NormLimit, Place};
use lgvi_control::{Constraint, Transfer};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::thrusters::{Thruster, Thrusters};
use lgvi_dynamics::wheels::Wheels;
use lgvi_dynamics::{BodyState, Load, RigidBody};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

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
    /// CPU time that IPOPT may take.
    seconds: Option<f64>,
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

/// What random maneuvers are solved by: the usual choice of unknowns, and the fastest of each solver.
pub(crate) const VARIED: [Solver; 3] = [
    Solver::new("IPOPT, controls", "ipopt", "controls", true, None).within(PATIENCE),
    Solver::new("IPOPT, states", "ipopt", "states", true, None).within(PATIENCE),
    Solver::new("fatrop, momenta", "fatrop", "momenta", true, None),
];

/// What maneuvers by thrusters and by wheels are solved by. Their commands follow from no states alone, so that those are the unknowns.
pub(crate) const ACTUATED: [Solver; 2] = [
    Solver::new("IPOPT", "ipopt", "controls", true, None).within(PATIENCE),
    Solver::new("fatrop", "fatrop", "controls", true, None),
];

/// CPU time (s) after which a random maneuver counts as not solved.
const PATIENCE: f64 = 10.0;

/// What a solve of a peer gave.
#[derive(Debug, Deserialize)]
pub(crate) struct Found {
    pub seconds: f64,
    pub wall: f64,
    pub iterations: u32,
    pub success: bool,
    pub status: String,
    pub cost: f64,
    /// Commands of each step.
    pub controls: Vec<Vec<f64>>,
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
            seconds: None,
        }
    }

    const fn within(self, seconds: f64) -> Self {
        Self {
            seconds: Some(seconds),
            ..self
        }
    }
}

impl Found {
    /// Commands that are force and moment.
    pub(crate) fn controls(&self) -> Vec<Load> {
        self.controls.iter().map(|u| load(u)).collect()
    }
}

/// Force and moment from their components.
pub(crate) fn load(u: &[f64]) -> Load {
    Load {
        force: Vector3::from_fn(|i, _| u[i]),
        moment: Vector3::from_fn(|i, _| u[3 + i]),
    }
}

/// How long a problem may take to be built and compiled for all solvers, and then to be solved by one.
const BUILDING: Duration = Duration::from_secs(900);
const SOLVING: Duration = Duration::from_secs(600);

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

    /// States the problem to solvers; the seconds that each took to get ready.
    pub(crate) fn build(
        &mut self,
        problem: &Stated<'_>,
        solvers: &[Solver],
    ) -> Result<Vec<f64>, BenchError> {
        let request = json!({"build": problem.to_json(), "solvers": solvers});
        let built: Built = self.0.ask(&request, BUILDING)?;
        Ok(built.build_seconds)
    }

    /// Solves from the guess with the solver of this index.
    pub(crate) fn solve(&mut self, solver: usize, controls: bool) -> Result<Found, BenchError> {
        self.solve_within(SOLVING, solver, controls)
    }

    /// Solves from the guess; the process is ended where it does not answer within `limit`.
    pub(crate) fn solve_within(
        &mut self,
        limit: Duration,
        solver: usize,
        controls: bool,
    ) -> Result<Found, BenchError> {
        let request = json!({"solve": solver, "controls": controls});
        self.0.ask(&request, limit)
    }
}

/// What is commanded, and what it costs.
pub(crate) enum Commanded<'p> {
    /// Force and moment.
    Loads { weights: [Matrix3<f64>; 2] },
    /// One-sided thrusters of the body, with a weight each, or a price where the cost is that of fuel.
    Thrusters { prices: &'p [f64], fuel: bool },
    /// The body's reaction wheels, with a weight each, which are to be fast or cheap.
    Wheels { weights: &'p [f64], fastest: bool },
}

/// A problem to be stated to the peers.
pub(crate) struct Stated<'p> {
    pub body: &'p RigidBody,
    pub gm: f64,
    pub h: f64,
    pub intervals: usize,
    pub commanded: Commanded<'p>,
    pub initial: &'p BodyState,
    pub target: BodyState,
    pub constraints: &'p [Constraint],
    /// A sphere whose radius differs from step to step.
    pub sphere: Option<Sphere>,
    /// Thrusters that are off, and the step from which they are.
    pub off: (&'p [usize], usize),
}

/// A sphere to stay in or out of, with its radius at the end of each step.
pub(crate) struct Sphere {
    pub inside: bool,
    pub center: Vector3<f64>,
    pub radii: Vec<f64>,
}

impl<'p> Stated<'p> {
    /// That of a transfer by what is commanded, without its inequalities.
    pub(crate) fn of(
        body: &'p RigidBody,
        gm: f64,
        transfer: &'p Transfer,
        commanded: Commanded<'p>,
    ) -> Result<Self, BenchError> {
        let target = transfer.target().state();
        let no_state = || BenchError::Body("a target that is no state".into());
        Ok(Self {
            body,
            gm,
            h: transfer.h(),
            intervals: transfer.intervals(),
            commanded,
            initial: transfer.initial(),
            target: target.ok_or_else(no_state)?,
            constraints: &[],
            sphere: None,
            off: (&[], 0),
        })
    }

    pub(crate) fn under(self, constraints: &'p [Constraint]) -> Self {
        Self {
            constraints,
            ..self
        }
    }

    pub(crate) fn with_sphere(self, sphere: Sphere) -> Self {
        Self {
            sphere: Some(sphere),
            ..self
        }
    }

    /// Without these thrusters from a step on.
    pub(crate) fn without(self, thrusters: &'p [usize], from: usize) -> Self {
        Self {
            off: (thrusters, from),
            ..self
        }
    }

    /// The problem and the guess as the script reads them.
    fn to_json(&self) -> Value {
        let Self { body, gm, h, .. } = *self;
        let field = Central { gm };
        let guess = guess::cold(body, &field, h, self.intervals, self.initial, &self.target);
        let points = body.points().iter();
        let mut points: Vec<_> = points
            .map(|point| {
                json!([
                    point.mass,
                    point.position.x,
                    point.position.y,
                    point.position.z
                ])
            })
            .collect();
        if points.is_empty() {
            points.push(json!([body.mass(), 0.0, 0.0, 0.0]));
        }
        let sphere = self.sphere.as_ref().map(|sphere| {
            let Sphere { center, radii, .. } = sphere;
            let kind = if sphere.inside { "inside" } else { "sphere" };
            json!({"kind": kind, "center": center.as_slice(), "radii": radii})
        });
        let control = |u: &Load| {
            [
                u.force.x, u.force.y, u.force.z, u.moment.x, u.moment.y, u.moment.z,
            ]
        };
        json!({
            "h": h,
            "mass": body.mass(),
            "gm": gm,
            "inertia": rows(body.inertia().matrix()),
            "points": points,
            "commanded": self.commanded.to_json(body),
            "initial": state(self.initial),
            "target": state(&self.target),
            "constraints": self.constraints.iter().filter_map(inequality).chain(sphere).collect::<Vec<_>>(),
            "off": self.off.0,
            "off_from": self.off.1,
            "guess": {
                "states": guess.states.iter().map(state).collect::<Vec<_>>(),
                "controls": guess.controls.iter().map(control).collect::<Vec<_>>(),
            },
        })
    }
}

impl Commanded<'_> {
    fn to_json(&self, body: &RigidBody) -> Value {
        match self {
            Self::Loads { weights } => json!({"weights": weights.map(|weight| rows(&weight))}),
            Self::Thrusters { prices, fuel } => {
                let thrusters = body.thrusters().map_or(&[][..], Thrusters::thrusters);
                let column = |thruster: &Thruster| {
                    let force = thruster.direction;
                    let moment = thruster.position.cross(&force);
                    [force.x, force.y, force.z, moment.x, moment.y, moment.z]
                };
                json!({
                    "columns": thrusters.iter().map(column).collect::<Vec<_>>(),
                    "limits": thrusters.iter().map(|thruster| thruster.thrust).collect::<Vec<_>>(),
                    "prices": prices,
                    "fuel": fuel,
                })
            }
            Self::Wheels { weights, fastest } => {
                let wheels = body.wheels().map_or(&[][..], Wheels::wheels);
                let axes = wheels.iter().map(|wheel| wheel.axis.as_slice());
                let limits = wheels.iter().map(|wheel| wheel.max_torque);
                json!({
                    "axes": axes.collect::<Vec<_>>(),
                    "limits": limits.collect::<Vec<_>>(),
                    "prices": weights,
                    "fastest": fastest,
                    "stored": body.wheels().map(|wheels| wheels.momentum().as_slice().to_vec()),
                })
            }
        }
    }
}

/// One that the script knows.
fn inequality(constraint: &Constraint) -> Option<Value> {
    if let Some(norm) = constraint.downcast_ref::<NormLimit>() {
        let kind = match norm.place() {
            Place::Position => "force",
            Place::Attitude => "moment",
        };
        return Some(json!({"kind": kind, "limit": norm.limit()}));
    }
    if let Some(cone) = constraint.downcast_ref::<KeepOutCone>() {
        return Some(json!({
            "kind": "cone",
            "axis": cone.axis().as_slice(),
            "direction": cone.direction().as_slice(),
            "half_angle": cone.half_angle(),
        }));
    }
    if let Some(sphere) = constraint.downcast_ref::<KeepOutSphere>() {
        let (center, radius) = (sphere.center(), sphere.radius());
        return Some(json!({"kind": "sphere", "center": center.as_slice(), "radius": radius}));
    }
    let corridor: &Corridor = constraint.downcast_ref()?;
    Some(json!({
        "kind": "corridor",
        "apex": corridor.apex().as_slice(),
        "axis": corridor.axis().as_slice(),
        "half_angle": corridor.half_angle(),
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
