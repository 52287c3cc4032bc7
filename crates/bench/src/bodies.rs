//! What a step costs against the number of bodies that attract each other, beside REBOUND.

use std::path::Path;

use lgvi_dynamics::gravity::{Multipole, Mutual};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{
    BodyState, Inertia, Load, Method, PointMass, RigidBody, Simulation, Skip, System,
};
use lgvi_truth::random::Random;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use serde_json::{Value, json};

use crate::clock::nanoseconds;
use crate::error::{BenchError, write_json};
use crate::peer::{Flyer, Python, REBOUND};
use crate::picture::{Axis, Curve, Picture};
use crate::spread::{Spread, short};
use crate::tables::Table;

const COUNTS: [usize; 9] = [1, 2, 4, 8, 16, 32, 64, 128, 256];
const QUICK: [usize; 2] = [1, 4];

const SEED: u64 = 1;

/// The step: of bodies some units apart that have masses of about 1.
const H: f64 = 1e-3;

/// Steps of a flight of the peer, so many that setting out does not count, and its work in pairs of bodies.
const FEWEST: usize = 20;
const PAIRS: usize = 2_000_000;

/// What the bodies are.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Points,
    /// Of second order.
    Multipoles,
}

const KINDS: [Kind; 2] = [Kind::Points, Kind::Multipoles];

/// Times of one step (ns), repetition by repetition.
#[derive(Serialize)]
struct Row {
    bodies: usize,
    points: Vec<f64>,
    multipoles: Vec<f64>,
    /// REBOUND's leapfrog, points; nothing without REBOUND.
    rebound: Vec<f64>,
}

/// Measures, keeps `bodies.json`, the table `bodies` and a picture.
pub(crate) fn run(
    quick: bool,
    python: Option<&Python>,
    repeats: u32,
    directory: &Path,
) -> Result<(), BenchError> {
    let python = python.filter(|python| !quick && python.has(REBOUND));
    let mut flyer = python.map(|python| Flyer::new(python, REBOUND));
    let counts: &[usize] = if quick { &QUICK } else { &COUNTS };
    let mut rows = Vec::new();
    for &bodies in counts {
        rows.push(row(bodies, flyer.as_mut(), repeats)?);
    }
    table(&rows)
        .below("Cost of a step against the number of bodies", "bodies.svg")
        .keep(directory, "bodies")?;
    write_json(&directory.join("bodies.json"), &rows)?;
    draw(&rows, directory)
}

fn row(bodies: usize, mut flyer: Option<&mut Flyer>, repeats: u32) -> Result<Row, BenchError> {
    let steps = (PAIRS / (bodies * bodies)).clamp(FEWEST, 20_000);
    let mut own = [simulation(bodies, KINDS[0])?, simulation(bodies, KINDS[1])?];
    let mut row = Row {
        bodies,
        points: Vec::new(),
        multipoles: Vec::new(),
        rebound: Vec::new(),
    };
    if let Some(flyer) = &mut flyer {
        flyer.offer(&case(&own[0], steps))?;
    }
    for _ in 0..repeats {
        row.points.push(step(&mut own[0])?);
        row.multipoles.push(step(&mut own[1])?);
        if let Some(flyer) = &mut flyer {
            let seconds = flyer.time("leapfrog", steps as f64)?;
            let seconds = seconds.map_err(BenchError::Peer)?;
            row.rebound.push(1e9 * seconds / steps as f64);
        }
    }
    Ok(row)
}

/// Bodies at random places, so far apart that none meet.
fn simulation(count: usize, kind: Kind) -> Result<Simulation, BenchError> {
    let refuse = |error: &dyn std::fmt::Display| BenchError::Body(error.to_string());
    let mut random = Random::new(SEED, count as u64);
    let width = 4.0 * (count as f64).cbrt();
    let (mut bodies, mut states) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let mass = random.uniform(0.5, 1.5);
        let inertia = match kind {
            Kind::Points => [mass; 3],
            Kind::Multipoles => [0.01, 0.02, 0.025].map(|moment| moment * mass),
        };
        let inertia = Inertia::principal(inertia).map_err(|error| refuse(&error))?;
        let body = match kind {
            Kind::Points => {
                let position = Vector3::zeros();
                RigidBody::new(mass, inertia, vec![PointMass { mass, position }])
            }
            Kind::Multipoles => {
                let multipole = Multipole::of_inertia(mass, &inertia);
                RigidBody::with_multipole(inertia, multipole)
            }
        };
        let body = body.map_err(|error| refuse(&error))?;
        let mut vector = |size: f64| Vector3::from_fn(|_, _| random.uniform(-size, size));
        let (position, velocity) = (vector(width), vector(0.1));
        let turn = match kind {
            Kind::Points => Vector3::zeros(),
            Kind::Multipoles => vector(1.0),
        };
        states.push(BodyState::from_velocities(
            &body,
            position,
            velocity,
            Matrix3::identity(),
            turn,
        ));
        bodies.push(body);
    }
    let system = System::new(bodies, vec![Box::new(Mutual::new(1.0))]);
    let simulation = Simulation::new(system, states, Method::Lgvi(Rotor::default()), H)?;
    Ok(simulation.with_skips(Skip::Exact))
}

/// Time (ns) of a step.
fn step(simulation: &mut Simulation) -> Result<f64, BenchError> {
    let start = simulation.states().to_vec();
    let controls = vec![Load::default(); start.len()];
    let mut failed = None;
    let time = nanoseconds(1, || {
        if let Err(error) = simulation.advance(&controls) {
            failed = Some(error);
        }
    });
    // bodies do not come near each other in one trial
    simulation.set_states(&start)?;
    failed.map_or(Ok(time), |error| Err(error.into()))
}

/// The same points as peers read them.
fn case(simulation: &Simulation, steps: usize) -> Value {
    let bodies = simulation.system().bodies().iter().zip(simulation.states());
    let bodies: Vec<_> = bodies
        .map(|(body, state)| {
            json!({
                "mass": body.mass(),
                "points": [[body.mass(), 0.0, 0.0, 0.0]],
                "x": state.position.as_slice(),
                "v": state.velocity(body).as_slice(),
                "Omega": [0.0, 0.0, 0.0],
            })
        })
        .collect();
    json!({
        "potential": "points",
        "parameters": {"G": 1.0},
        "bodies": bodies,
        "times": [H * steps as f64],
    })
}

fn median(times: &[f64]) -> Option<f64> {
    Spread::of(times.iter().copied()).map(|spread| spread.median)
}

fn table(rows: &[Row]) -> Table {
    let beside = rows.iter().any(|row| !row.rebound.is_empty());
    let mut head = vec!["bodies", "points (µs)", "multipoles (µs)"];
    if beside {
        head.push("points, in parts of REBOUND's leapfrog");
    }
    let mut table = Table::new(head);
    for row in rows {
        let time = |times| median(times).map_or_else(String::new, |time| short(1e-3 * time));
        let mut cells = vec![
            row.bodies.to_string(),
            time(&row.points),
            time(&row.multipoles),
        ];
        if beside {
            let ratio = Spread::of_ratios(&row.points, &row.rebound);
            cells.push(ratio.map_or_else(String::new, |ratio| ratio.to_string()));
        }
        table.row(cells);
    }
    table
}

fn draw(rows: &[Row], directory: &Path) -> Result<(), BenchError> {
    let curve = |label: &str, times: fn(&Row) -> &[f64]| {
        let point = |row: &Row| Some([row.bodies as f64, 1e-9 * median(times(row))?]);
        Curve {
            label: label.into(),
            points: rows.iter().filter_map(point).collect(),
        }
    };
    let own = [
        curve("LGVI, points", |row| &row.points),
        curve("LGVI, multipoles", |row| &row.multipoles),
    ];
    let rebound = curve("REBOUND leapfrog, points", |row| &row.rebound);
    let others: Vec<_> = [rebound]
        .into_iter()
        .filter(|curve| !curve.points.is_empty())
        .collect();
    let picture = Picture {
        title: "cost of a step against the number of bodies".into(),
        horizontal: Axis::logarithmic("bodies"),
        vertical: Axis::logarithmic("CPU time of a step (s)"),
    };
    picture.draw_beside(&directory.join("bodies.svg"), &own, &others)
}
