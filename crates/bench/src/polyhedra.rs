//! Polyhedra of many faces: an orbit about one beside a plain C++ loop over its faces, and the mutual attraction of two.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use lgvi_dynamics::gravity::{Fixed, Gravity, Mutual, Polyhedron, PolyhedronField};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};
use nalgebra::{Matrix3, Vector3};

use crate::clock::{Moment, nanoseconds};
use crate::error::BenchError;
use crate::peer::compiled;
use crate::spread::{Spread, short};
use crate::tables::Table;

/// The primary and the secondary of a binary like 1999 KW4 (m), and its density (kg/m³).
const AXES: [[f64; 3]; 2] = [[708.5, 680.5, 591.5], [297.5, 225.0, 171.5]];
const DENSITY: f64 = 1970.0;
const G: f64 = 6.6743e-11;

/// Subdivisions of the orbited body's mesh: 1280, 5120 and 20 480 faces.
const SUBDIVISIONS: [u32; 3] = [3, 4, 5];

/// Of an orbit: radii in multiples of the longest semi-axis, step and duration (s). Within 1.5 or so, the closed form is
/// computed, further away a series.
const RADII: [f64; 3] = [1.3, 2.0, 4.0];
const STEP: f64 = 120.0;
const DAY: f64 = 86_400.0;

/// Distances of the two bodies of a pair, in multiples of the sum of their radii.
const DISTANCES: [f64; 5] = [1.2, 1.5, 2.0, 2.5, 5.0];

const PEER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/polyhedron.cpp");

/// Keeps the tables `polyhedron_orbit` and `polyhedron_pair`.
pub(crate) fn run(repeats: u32, directory: &Path) -> Result<(), BenchError> {
    let peer = Peer::compile();
    if let Err(error) = &peer {
        println!("no C++ loop: {error}");
    }
    let peer = peer.ok();
    orbits(peer.as_ref(), repeats, directory)?;
    pairs(peer.as_ref(), repeats, directory)
}

fn orbits(peer: Option<&Peer>, repeats: u32, directory: &Path) -> Result<(), BenchError> {
    let mut table = Table::new([
        "faces",
        "radius of the orbit",
        "a day (ms)",
        "plain C++ loop (ms)",
        "C++ loop over lgvi",
        "difference of the last positions",
    ]);
    for subdivisions in SUBDIVISIONS {
        let shape = ellipsoid(AXES[0], subdivisions)?;
        for radius in RADII {
            let orbit = Orbit::new(&shape, radius * AXES[0][0]);
            let (mut own, mut beside) = (Vec::new(), Vec::new());
            let mut difference = None;
            for _ in 0..repeats {
                let (seconds, last) = orbit.fly(&shape)?;
                own.push(seconds);
                if let Some(peer) = peer {
                    let (seconds, there) = peer.fly(&shape, &orbit)?;
                    beside.push(seconds);
                    difference = Some((last - there).norm() / last.norm());
                }
            }
            let ratio = Spread::of_ratios(&beside, &own);
            table.row([
                shape.faces().len().to_string(),
                format!("{radius}"),
                milliseconds(&own),
                milliseconds(&beside),
                ratio.map_or_else(String::new, |ratio| ratio.to_string()),
                difference.map_or_else(String::new, |error| format!("{error:.0e}")),
            ]);
        }
    }
    table.keep(directory, "polyhedron_orbit")
}

fn pairs(peer: Option<&Peer>, repeats: u32, directory: &Path) -> Result<(), BenchError> {
    let mut table = Table::new([
        "distance over the sum of the radii",
        "loads of both (µs)",
        "the same points in a plain C++ loop (µs)",
        "C++ loop over lgvi",
    ]);
    let shapes = [ellipsoid(AXES[0], 3)?, ellipsoid(AXES[1], 3)?];
    let [first, second] = shapes
        .each_ref()
        .map(|shape| RigidBody::with_polyhedron(None, shape, 4).map_err(|error| refused(&error)));
    let bodies = [first?, second?];
    for ratio in DISTANCES {
        let distance = ratio * (AXES[0][0] + AXES[1][0]);
        let states = [0.0, distance].map(|x| BodyState {
            position: Vector3::new(0.6 * x, 0.48 * x, 0.64 * x),
            linear_momentum: Vector3::zeros(),
            attitude: lgvi_lie::exp(&Vector3::new(0.3, x / distance, -0.4)),
            angular_momentum: Vector3::zeros(),
        });
        let (mut own, mut beside) = (Vec::new(), Vec::new());
        for _ in 0..repeats {
            let mut mutual = Mutual::new(G);
            own.push(
                1e-9 * nanoseconds(1, || {
                    let mut loads = [Load::default(); 2];
                    mutual.add_loads(&bodies, std::hint::black_box(&states), &mut loads);
                    std::hint::black_box(&loads);
                }),
            );
            if let Some(peer) = peer {
                let orbit = Orbit::new(&shapes[0], distance);
                let (seconds, _) = peer.fly(&shapes[0], &orbit)?;
                let evaluations = (orbit.steps + 1) as f64;
                beside.push(bodies[1].points().len() as f64 * seconds / evaluations);
            }
        }
        let microseconds = |seconds: &[f64]| {
            let spread = Spread::of(seconds.iter().copied());
            spread.map_or_else(String::new, |spread| short(1e6 * spread.median))
        };
        let compared = Spread::of_ratios(&beside, &own);
        table.row([
            format!("{ratio}"),
            microseconds(&own),
            microseconds(&beside),
            compared.map_or_else(String::new, |ratio| ratio.to_string()),
        ]);
    }
    table.keep(directory, "polyhedron_pair")
}

fn ellipsoid(axes: [f64; 3], subdivisions: u32) -> Result<Polyhedron, BenchError> {
    Polyhedron::ellipsoid(axes, subdivisions, DENSITY).map_err(|error| refused(&error))
}

fn milliseconds(seconds: &[f64]) -> String {
    let spread = Spread::of(seconds.iter().copied());
    spread.map_or_else(String::new, |spread| short(1e3 * spread.median))
}

fn refused(error: &dyn std::fmt::Display) -> BenchError {
    BenchError::Body(error.to_string())
}

/// An inclined, nearly circular orbit of a point.
struct Orbit {
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    steps: u64,
}

impl Orbit {
    fn new(shape: &Polyhedron, radius: f64) -> Self {
        let speed = (G * shape.mass() / radius).sqrt();
        Self {
            position: Vector3::new(radius, 0.0, 0.0),
            velocity: speed * Vector3::new(0.0, 0.8, 0.6),
            steps: (DAY / STEP) as u64,
        }
    }

    /// Time (s) and last position of the flight with LGVI, which is a leapfrog here.
    fn fly(&self, shape: &Polyhedron) -> Result<(f64, Vector3<f64>), BenchError> {
        let inertia = Inertia::principal([1.0; 3]).map_err(|error| refused(&error))?;
        let body = RigidBody::new(1.0, inertia, vec![]).map_err(|error| refused(&error))?;
        let zero = Vector3::zeros();
        let state = BodyState::from_velocities(
            &body,
            self.position,
            self.velocity,
            Matrix3::identity(),
            zero,
        );
        let source = Fixed::new(PolyhedronField::new(shape, G), zero, Matrix3::identity());
        let field: Box<dyn Gravity> = Box::new(source);
        let system = System::new(vec![body], vec![field]);
        let mut simulation =
            Simulation::new(system, vec![state], Method::Lgvi(Rotor::Discrete), STEP)?;
        let begun = Moment::now();
        for _ in 0..self.steps {
            simulation.advance(&[Load::default()])?;
        }
        Ok((begun.elapsed(), simulation.states()[0].position))
    }
}

/// The C++ loop, compiled here and removed in the end.
struct Peer(tempfile::TempPath);

impl Peer {
    fn compile() -> Result<Self, BenchError> {
        compiled(PEER, &["-O3", "-march=native", "-std=c++17"]).map(Self)
    }

    /// As [`Orbit::fly`].
    fn fly(&self, shape: &Polyhedron, orbit: &Orbit) -> Result<(f64, Vector3<f64>), BenchError> {
        let refuse = |error: std::io::Error| BenchError::Peer(error.to_string());
        let strength = G * shape.density();
        let mut text = format!("{strength:?} {STEP:?} {}\n", orbit.steps);
        let mut add = |v: &Vector3<f64>| text += &format!("{:?} {:?} {:?}\n", v.x, v.y, v.z);
        add(&orbit.position);
        add(&orbit.velocity);
        let mut mesh = format!("{} {}\n", shape.vertices().len(), shape.faces().len());
        for v in shape.vertices() {
            mesh += &format!("{:?} {:?} {:?}\n", v.x, v.y, v.z);
        }
        for [a, b, c] in shape.faces() {
            mesh += &format!("{a} {b} {c}\n");
        }
        let mut process = Command::new(&self.0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(refuse)?;
        if let Some(mut input) = process.stdin.take() {
            input.write_all((text + &mesh).as_bytes()).map_err(refuse)?;
        }
        let output = process.wait_with_output().map_err(refuse)?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
        match numbers.as_deref() {
            Ok([seconds, x, y, z]) => Ok((*seconds, Vector3::new(*x, *y, *z))),
            _ => Err(BenchError::Peer(format!("the C++ loop said {text:?}"))),
        }
    }
}
