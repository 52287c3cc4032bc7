//! Random flights for the automatic choice of an integrator. The same seed and index give the same flight on every
//! machine.
//!
//! In the units used, `GM`, the semi-major axis and the mass of the heaviest body are of the order of 1. Every model of
//! gravity and every mobility has its [`Class`]. The distributions are:
//!
//! - Eccentricities are uniform up to 0.97. For three in four extended bodies about a center the limit is 0.05, because
//!   librations are chaotic beyond. For bodies that attract each other the limit is 0.3.
//! - Starts are anywhere on the orbit.
//! - Numbers of periods are log-uniform in 1 … 1000. The limit is 100 or 10 if gravity is expensive or the motion may
//!   become chaotic.
//! - Tolerances are log-uniform in 1e-13 … 1e-3.

use std::f64::consts::TAU;
use std::sync::Arc;

use lgvi_dynamics::auto::Run;
use lgvi_dynamics::gravity::{Central, Gravity, Multipole, Mutual, Polyhedron, Uniform};
use lgvi_dynamics::{
    Accuracy, BodyState, Drive, Inertia, Load, Method, Mobility, PointMass, RigidBody, Simulation,
    System,
};
use nalgebra::{Matrix3, Vector3};

use crate::kepler::{self, eccentric_anomaly};
use crate::random::Random;

/// The class of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// A sphere about a fixed center.
    Kepler,
    /// A librating body of point masses about a fixed center.
    Points,
    /// A librating cuboid, represented by its multipole, about a fixed center.
    Cuboid,
    /// A sphere about an oblate planet.
    Oblate,
    /// A pivoted body in a uniform field.
    Pendulum,
    /// Two or three spheres with mutual attraction.
    Spheres,
    /// Two bodies of point masses with mutual attraction.
    Rubble,
    /// Two bodies with mutual attraction by their multipoles.
    Multipoles,
    /// A small body about a polyhedron.
    Polyhedron,
    /// A small body about a body of point masses that is fixed or driven.
    Given,
    /// A free body without gravity.
    Free,
}

impl Class {
    /// All classes.
    pub const ALL: [Self; 11] = [
        Self::Kepler,
        Self::Points,
        Self::Cuboid,
        Self::Oblate,
        Self::Pendulum,
        Self::Spheres,
        Self::Rubble,
        Self::Multipoles,
        Self::Polyhedron,
        Self::Given,
        Self::Free,
    ];
}

/// A random flight.
#[derive(Clone)]
pub struct Flight {
    /// The class.
    pub class: Class,
    /// The bodies.
    pub bodies: Vec<RigidBody>,
    /// Initial states, one per body.
    pub states: Vec<BodyState>,
    /// Duration and number of steps.
    pub run: Run,
    /// Error allowed at the end.
    pub tolerance: f64,
    gravity: Arc<dyn Fn() -> Vec<Box<dyn Gravity>> + Send + Sync>,
}

/// The reference solution at the end of a flight.
pub struct Truth {
    states: Vec<BodyState>,
    accuracy: Accuracy,
    /// Difference of two independent solutions, or 0 for a solution in closed form.
    pub doubt: f64,
}

/// Number of steps of the finest flight that is compared with a reference solution.
const FINEST: u64 = 1 << 19;

impl Flight {
    /// Returns flight `index` of `seed`.
    ///
    /// # Panics
    /// Never panics: the numbers drawn always define valid bodies.
    pub fn random(seed: u64, index: u64) -> Self {
        let mut random = Random::new(seed, index);
        let class = Class::ALL[(index % Class::ALL.len() as u64) as usize];
        Self::drawn(class, &mut random)
    }

    /// Returns the flight of a sphere without spin about a fixed center, from periapsis or apoapsis.
    ///
    /// # Panics
    /// Never.
    pub fn kepler(eccentricity: f64, periapsis: bool, periods: f64, tolerance: f64) -> Self {
        let body = sphere(1.0, 0.01);
        let sign = if periapsis { 1.0 } else { -1.0 };
        let e = sign * eccentricity;
        let position = Vector3::new(1.0 - e, 0.0, 0.0);
        let velocity = Vector3::new(0.0, ((1.0 + e) / (1.0 - e)).sqrt(), 0.0);
        let state = start(
            &body,
            position,
            velocity,
            Matrix3::identity(),
            Vector3::zeros(),
        );
        Self {
            class: Class::Kepler,
            bodies: vec![body],
            states: vec![state],
            run: Run {
                duration: TAU * periods,
                steps: 1000,
            },
            tolerance,
            gravity: Arc::new(|| vec![Box::new(Central { gm: 1.0 })]),
        }
    }

    fn drawn(class: Class, random: &mut Random) -> Self {
        let (periods, eccentric) = match class {
            Class::Kepler | Class::Oblate => (1000.0, 0.97),
            Class::Points | Class::Cuboid => {
                (1000.0, if random.below(4) == 0 { 0.97 } else { 0.05 })
            }
            Class::Free | Class::Pendulum => (1000.0, 0.6),
            Class::Spheres | Class::Given | Class::Multipoles => (100.0, 0.3),
            Class::Rubble | Class::Polyhedron => (10.0, 0.3),
        };
        let periods = random.log_uniform(1.0, periods);
        let eccentricity = random.uniform(0.0, eccentric);
        let tolerance = random.log_uniform(1e-13, 1e-3);
        let steps = random.log_uniform(20.0, 20_000.0) as u64;
        let [position, velocity] = orbit(random, eccentricity);
        let normal = position.cross(&velocity).normalize();
        let mut gm = 1.0;
        let turned = random.rotation();
        let size = random.log_uniform(1e-6, 1e-2);
        let spin = random.uniform(0.3, 2.0) * random.direction();
        let (bodies, states, gravity): (_, _, Arc<dyn Fn() -> _ + Send + Sync>) = match class {
            Class::Kepler => {
                let body = sphere(1.0, size);
                let state = start(&body, position, velocity, turned, spin);
                let gravity = || vec![Box::new(Central { gm: 1.0 }) as Box<dyn Gravity>];
                (vec![body], vec![state], Arc::new(gravity))
            }
            Class::Points | Class::Cuboid => {
                let body = if class == Class::Points {
                    cluster(random, 1.0, size)
                } else {
                    let inertia = cuboid(random, 1.0, size);
                    let multipole = Multipole::of_inertia(1.0, &inertia);
                    made(RigidBody::with_multipole(inertia, multipole))
                };
                // Rotation with the orbit, plus a libration.
                let radial = position.normalize();
                let frame = Matrix3::from_columns(&[radial, normal.cross(&radial), normal]);
                let rate = position.cross(&velocity).norm() / position.norm_squared();
                let off = lgvi_lie::exp(&(random.uniform(0.0, 0.3) * random.direction()));
                let spin = Vector3::new(0.0, 0.0, rate) + 0.05 * spin;
                let state = start(&body, position, velocity, frame * off, spin);
                let gravity = || vec![Box::new(Central { gm: 1.0 }) as Box<dyn Gravity>];
                (vec![body], vec![state], Arc::new(gravity))
            }
            Class::Oblate => {
                let body = sphere(1.0, size);
                let radius = 0.9 * (1.0 - eccentricity);
                let state = start(&body, position, velocity, turned, spin);
                let gravity = move || {
                    vec![Box::new(Multipole::oblate(1.0, 1.1e-3, radius)) as Box<dyn Gravity>]
                };
                (vec![body], vec![state], Arc::new(gravity))
            }
            Class::Pendulum => {
                let inertia = cuboid(random, 1.0, 1.0);
                let center = PointMass {
                    mass: 1.0,
                    position: Vector3::new(0.0, 0.0, 1.0),
                };
                let whole = inertia.matrix() + Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0));
                let body = made(
                    Inertia::new(whole)
                        .map(|inertia| made(RigidBody::pivoted(1.0, inertia, vec![center]))),
                );
                let off = random.uniform(0.05, 1.0) * Vector3::new(1.0, 0.3, 0.0).normalize();
                let down = lgvi_lie::exp(&off);
                let state = start(&body, Vector3::zeros(), Vector3::zeros(), down, 0.1 * spin);
                let acceleration = Vector3::new(0.0, 0.0, 1.0);
                let gravity = move || vec![Box::new(Uniform { acceleration }) as Box<dyn Gravity>];
                (vec![body], vec![state], Arc::new(gravity))
            }
            Class::Free => {
                let inertia = cuboid(random, 1.0, 1.0);
                let body = made(RigidBody::new(1.0, inertia, vec![]));
                let state = start(&body, position, 0.01 * velocity, turned, spin);
                (vec![body], vec![state], Arc::new(Vec::new))
            }
            _ => {
                let light = random.log_uniform(1e-3, 1.0);
                let [heavy, other] = match class {
                    Class::Spheres => [sphere(1.0, 0.1), sphere(light, 0.05)],
                    Class::Rubble | Class::Given => {
                        [cluster(random, 1.0, 0.1), cluster(random, light, 0.05)]
                    }
                    Class::Multipoles => [(1.0, 0.1), (light, 0.05)].map(|(mass, size)| {
                        let inertia = cuboid(random, mass, size);
                        let multipole = Multipole::of_inertia(mass, &inertia);
                        made(RigidBody::with_multipole(inertia, multipole))
                    }),
                    _ => {
                        let axes = [0.1, 0.08, 0.06].map(|axis| axis * random.uniform(0.8, 1.25));
                        let shape = made(Polyhedron::cuboid(axes, 1.0));
                        let shape = made(shape.with_mass(1.0));
                        [
                            made(RigidBody::with_polyhedron(None, &shape, 2)),
                            cluster(random, light, 0.02),
                        ]
                    }
                };
                let given = class == Class::Given;
                let total = if given { 1.0 } else { 1.0 + light };
                gm = total;
                let velocity = velocity * total.sqrt();
                let mut bodies = vec![heavy, other];
                let part = if given { 0.0 } else { -light / total };
                let mut states = vec![
                    start(
                        &bodies[0],
                        part * position,
                        part * velocity,
                        turned,
                        0.5 * spin,
                    ),
                    start(
                        &bodies[1],
                        (1.0 + part) * position,
                        (1.0 + part) * velocity,
                        random.rotation(),
                        spin,
                    ),
                ];
                if given {
                    let drive = Drive::uniform(Vector3::zeros(), 0.4 * spin);
                    let mobility = if random.below(2) == 0 {
                        Mobility::Fixed
                    } else {
                        Mobility::Driven(drive)
                    };
                    bodies[0] = bodies[0].clone().with_mobility(mobility);
                }
                if class == Class::Spheres && random.below(2) == 0 {
                    let far = sphere(1e-2 * light, 0.05);
                    let distance = random.uniform(6.0, 10.0);
                    let there = distance * position.normalize();
                    let speed = (total / distance).sqrt();
                    let across = speed * normal.cross(&position.normalize());
                    states.push(start(&far, there, across, turned, spin));
                    bodies.push(far);
                }
                let gravity = || vec![Box::new(Mutual::new(1.0)) as Box<dyn Gravity>];
                (bodies, states, Arc::new(gravity))
            }
        };
        Self {
            class,
            bodies,
            states,
            run: Run {
                duration: periods * TAU / gm.sqrt(),
                steps,
            },
            tolerance,
            gravity,
        }
    }

    /// Returns the bodies and their gravity.
    pub fn system(&self) -> System {
        System::new(self.bodies.clone(), (self.gravity)())
    }

    /// Returns the reference solution at the end, in closed form if available. Otherwise Fehlberg's method computes it
    /// with a tolerance below the rounding error. Its uncertainty is the distance to a Nyström splitting, whose steps
    /// are refined until the distance is well below the flight's tolerance or stops decreasing. Returns `None` if a
    /// step of Fehlberg's method fails.
    pub fn truth(&self) -> Option<Truth> {
        let system = self.system();
        let mut states = self.states.clone();
        system.constrain(&mut states);
        let accuracy = Accuracy::new(system.bodies(), &states);
        let h = self.run.duration / self.run.steps as f64;
        let t = h * self.run.steps as f64;
        if let (Class::Kepler, [body], [state]) = (self.class, &self.bodies[..], &self.states[..]) {
            let mut end = *state;
            end.position = kepler::position(1.0, &state.position, &state.velocity(body), t);
            end.attitude = kepler::spun(&state.attitude, &state.angular_velocity(body), t);
            let states = vec![end];
            return Some(Truth {
                states,
                accuracy,
                doubt: 0.0,
            });
        }
        let tolerance = 1e-17;
        let found = self.fly(Method::Fehlberg78 { tolerance }, 1, 1)?;
        let nystrom = Method::Nystrom { order: 8 };
        let mut doubt = f64::INFINITY;
        let mut steps = 256;
        // Number of refinements without progress.
        let mut vain = 0;
        while steps <= FINEST && doubt > 0.1 * self.tolerance && vain < 3 {
            if let Some(other) = self.fly(nystrom, steps, 1) {
                let error = accuracy.error(&other, &found);
                vain = if error < 0.5 * doubt {
                    0
                } else {
                    vain + u32::from(error < 0.1)
                };
                doubt = doubt.min(error);
            }
            steps *= 2;
        }
        Some(Truth {
            states: found,
            accuracy,
            doubt,
        })
    }

    /// Returns the final states by a method, or `None` if it fails.
    pub fn fly(&self, method: Method, steps: u64, substeps: u32) -> Option<Vec<BodyState>> {
        let h = self.run.duration / steps as f64;
        let simulation = Simulation::new(self.system(), self.states.clone(), method, h).ok()?;
        let mut simulation = simulation.with_substeps(substeps);
        let controls = vec![Load::default(); self.states.len()];
        for _ in 0..steps {
            simulation.advance(&controls).ok()?;
        }
        Some(simulation.states().to_vec())
    }
}

impl Truth {
    /// Returns the error of the given final states.
    pub fn error(&self, states: &[BodyState]) -> f64 {
        self.accuracy.error(states, &self.states)
    }
}

fn start(
    body: &RigidBody,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    attitude: Matrix3<f64>,
    spin: Vector3<f64>,
) -> BodyState {
    BodyState::from_velocities(body, position, velocity, attitude, spin)
}

/// Draws the position and velocity at a random point of an orbit of semi-major axis 1.
fn orbit(random: &mut Random, eccentricity: f64) -> [Vector3<f64>; 2] {
    let frame = random.rotation();
    let anomaly = eccentric_anomaly(random.uniform(0.0, TAU), eccentricity);
    let (sin, cos) = (libm::sin(anomaly), libm::cos(anomaly));
    let minor = (1.0 - eccentricity * eccentricity).sqrt();
    let rate = 1.0 / (1.0 - eccentricity * cos);
    [
        frame * Vector3::new(cos - eccentricity, minor * sin, 0.0),
        frame * Vector3::new(-sin, minor * cos, 0.0) * rate,
    ]
}

fn sphere(mass: f64, radius: f64) -> RigidBody {
    let inertia = made(Inertia::principal([0.4 * mass * radius * radius; 3]));
    made(RigidBody::new(mass, inertia, vec![]))
}

/// Draws the moments of inertia of a cuboid of about this size.
fn cuboid(random: &mut Random, mass: f64, size: f64) -> Inertia {
    let [a, b, c] = [0.4, 0.7, 1.0].map(|axis| {
        let axis = size * axis * random.uniform(0.85, 1.15);
        mass * axis * axis / 12.0
    });
    made(Inertia::principal([a + b, a + c, b + c]))
}

/// Draws three pairs of points on axes of unequal length.
fn cluster(random: &mut Random, mass: f64, size: f64) -> RigidBody {
    let axes = [1.0, 0.7, 0.4].map(|axis| size * axis * random.uniform(0.85, 1.15));
    let mut points = Vec::new();
    let mut second = Matrix3::zeros();
    for (axis, length) in axes.into_iter().enumerate() {
        for sign in [1.0, -1.0] {
            let mut position = Vector3::zeros();
            position[axis] = sign * length;
            second += mass / 6.0 * position * position.transpose();
            points.push(PointMass {
                mass: mass / 6.0,
                position,
            });
        }
    }
    let inertia = Matrix3::from_diagonal_element(second.trace()) - second;
    made(Inertia::new(inertia).map(|inertia| made(RigidBody::new(mass, inertia, points))))
}

/// Unwraps a result that is always `Ok` for the numbers drawn.
#[allow(clippy::expect_used)]
fn made<T, E: std::fmt::Debug>(result: Result<T, E>) -> T {
    result.expect("numbers that make a body")
}
