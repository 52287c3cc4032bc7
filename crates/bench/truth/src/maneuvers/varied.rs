//! Maneuvers of several families, with and without inequality constraints, in units as a user might choose them.
//!
//! **Slews** go from rest to rest between uniformly distributed attitudes, with bodies of three unequal principal
//! moments, either free or around a keep-out cone. **Transfers** take a point mass or a dumbbell from one near-circular
//! orbit to another in 0.3 to 3 revolutions. **Limited** maneuvers are slews and transfers whose forces or moments are
//! bounded at 1.01 to 3 times the estimated least feasible limits. **Spheres** obstruct the path of a rest-to-rest
//! motion or a transfer. **Corridors** end at the target.

use std::f64::consts::{PI, TAU};

use lgvi_control::constraint::{Corridor, KeepOutCone, KeepOutSphere, NormLimit, Place};
use lgvi_control::{Actuation, Constraint, NewtonSettings, PlanError, Start, Transfer, solve};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, PointMass, RigidBody};
use nalgebra::{Matrix3, Vector3};

use super::ManeuverError;
use super::orbit::spheres_on_a_rod;
use crate::random::Random;

/// The family of a maneuver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// From rest to rest by attitude alone.
    Slew,
    /// From orbit to orbit.
    Transfer,
    /// With limits of force and moment.
    Limited,
    /// A slew around a keep-out cone.
    Cone,
    /// Around a keep-out sphere.
    Sphere,
    /// Along a corridor.
    Corridor,
}

impl Family {
    /// All families.
    pub const ALL: [Self; 6] = [
        Self::Slew,
        Self::Transfer,
        Self::Limited,
        Self::Cone,
        Self::Sphere,
        Self::Corridor,
    ];

    /// Returns the name of the family.
    pub fn name(self) -> &'static str {
        match self {
            Self::Slew => "slews",
            Self::Transfer => "orbit transfers",
            Self::Limited => "command limits",
            Self::Cone => "keep-out cones",
            Self::Sphere => "keep-out spheres",
            Self::Corridor => "corridors",
        }
    }
}

/// A maneuver of a family.
#[derive(Clone)]
pub struct Varied {
    /// The family.
    pub family: Family,
    /// The controlled body.
    pub body: RigidBody,
    /// Weights of force and moment.
    pub weights: [Matrix3<f64>; 2],
    /// Gravitational parameter of the attractor at the origin.
    pub gm: f64,
    /// The optimal control problem.
    pub transfer: Transfer,
    /// The inequality constraints of the problem.
    pub constraints: Vec<Constraint>,
    /// Units of length, mass and time of the [stated](Self::stated) problem.
    pub units: [f64; 3],
}

/// Returns maneuver `index` of `seed` with this number of steps. The index cycles through the families.
pub fn varied(seed: u64, index: u64, intervals: usize) -> Result<Varied, ManeuverError> {
    let mut random = Random::new(seed, index);
    let family = Family::ALL[(index % Family::ALL.len() as u64) as usize];
    let random = &mut random;
    let drawn = match family {
        Family::Slew => slew(random, family, intervals),
        Family::Transfer => orbits(random, family, intervals),
        Family::Limited => {
            let free = if random.below(2) == 0 {
                slew(random, family, intervals)?
            } else {
                orbits(random, family, intervals)?
            };
            limited(random, free)
        }
        Family::Cone => {
            let free = slew(random, family, intervals)?;
            past_a_cone(random, free)
        }
        Family::Sphere => {
            let free = if random.below(2) == 0 {
                crossing(random, family, intervals)?
            } else {
                orbits(random, family, intervals)?
            };
            past_a_sphere(random, free)
        }
        Family::Corridor => {
            let free = crossing(random, family, intervals)?;
            down_a_corridor(random, free)
        }
    }?;
    Ok(Varied {
        units: [0; 3].map(|_| random.log_uniform(1e-3, 1e3)),
        ..drawn
    })
}

/// Draws a slew from rest to rest at a fixed position.
fn slew(random: &mut Random, family: Family, intervals: usize) -> Result<Varied, ManeuverError> {
    let body = brick(random)?;
    let ends = [0, 1].map(|_| BodyState {
        position: Vector3::x(),
        linear_momentum: Vector3::zeros(),
        attitude: random.rotation(),
        angular_momentum: Vector3::zeros(),
    });
    let duration = random.log_uniform(1.0, 10.0);
    finish(random, family, body, 0.0, duration, intervals, ends)
}

/// Draws a motion from rest to rest at another position, with a slew.
pub(super) fn crossing(
    random: &mut Random,
    family: Family,
    intervals: usize,
) -> Result<Varied, ManeuverError> {
    let body = brick(random)?;
    let (_, ends) = at_rest(random);
    let duration = random.log_uniform(1.0, 10.0);
    finish(random, family, body, 0.0, duration, intervals, ends)
}

/// Draws a way and two states of rest at its ends.
pub(super) fn at_rest(random: &mut Random) -> (Vector3<f64>, [BodyState; 2]) {
    let apart = random.log_uniform(0.3, 3.0) * random.direction();
    let ends = [Vector3::x(), Vector3::x() + apart].map(|position| BodyState {
        position,
        linear_momentum: Vector3::zeros(),
        attitude: random.rotation(),
        angular_momentum: Vector3::zeros(),
    });
    (apart, ends)
}

/// Draws a transfer from one near-circular orbit to another, with the body x axis along the velocity at both ends.
fn orbits(random: &mut Random, family: Family, intervals: usize) -> Result<Varied, ManeuverError> {
    let body = if random.below(2) == 0 {
        brick(random)?
    } else {
        dumbbell(random)?
    };
    let revolutions = random.uniform(0.3, 3.0);
    let tilt = random.uniform(0.0, 30.0_f64.to_radians());
    let radius = random.log_uniform(0.8, 1.6);
    let speed = random.uniform(0.95, 1.05);
    let begin = random.uniform(0.0, TAU);
    let normal = Vector3::z();
    let first = Vector3::x();
    let node = random.uniform(0.0, TAU);
    let node = Vector3::new(libm::cos(node), libm::sin(node), 0.0);
    let tilted = lgvi_lie::exp(&(tilt * node));
    let at = |frame: &Matrix3<f64>, angle: f64, radius: f64, speed: f64| {
        let outward = frame * lgvi_lie::exp(&(angle * normal)) * first;
        let along = frame * lgvi_lie::exp(&((angle + 0.5 * PI) * normal)) * first;
        let rate = speed / (radius * radius.sqrt());
        BodyState::from_velocities(
            &body,
            radius * outward,
            radius * rate * along,
            Matrix3::from_columns(&[along, -outward, frame * normal]),
            Vector3::new(0.0, 0.0, rate),
        )
    };
    let mean = 0.5 * (1.0 + radius);
    let duration = revolutions * TAU * mean * mean.sqrt();
    let end = begin + revolutions * TAU + random.uniform(-0.3, 0.3);
    let ends = [
        at(&Matrix3::identity(), begin, 1.0, speed),
        at(&tilted, end, radius, 1.0),
    ];
    finish(random, family, body, 1.0, duration, intervals, ends)
}

/// Draws a body with three unequal axes, on which gravity acts at the center of mass.
pub(super) fn brick(random: &mut Random) -> Result<RigidBody, ManeuverError> {
    let mass = random.log_uniform(0.3, 3.0);
    let axes = Vector3::from_fn(|_, _| random.log_uniform(0.05, 0.3));
    let spread = axes.component_mul(&axes) / 3.0;
    let moments = Vector3::from_element(spread.sum()) - spread;
    let inertia = Inertia::principal((mass * moments).into())?;
    Ok(RigidBody::new(mass, inertia, Vec::new())?)
}

/// Draws two spheres on a rod along body x.
fn dumbbell(random: &mut Random) -> Result<RigidBody, ManeuverError> {
    let mass = random.log_uniform(0.3, 3.0);
    let length = random.log_uniform(0.05, 0.3);
    let axial = 0.4 * mass * length * length * random.log_uniform(0.03, 0.2);
    spheres_on_a_rod(mass, length, axial)
}

fn finish(
    random: &mut Random,
    family: Family,
    body: RigidBody,
    gm: f64,
    duration: f64,
    intervals: usize,
    [initial, target]: [BodyState; 2],
) -> Result<Varied, ManeuverError> {
    let squared_radius = 0.5 * body.inertia().matrix().trace() / body.mass();
    let force = Matrix3::from_diagonal_element(random.log_uniform(0.3, 3.0));
    let moment = Matrix3::from_diagonal_element(random.log_uniform(0.1, 3.0) / squared_radius);
    Ok(Varied {
        family,
        transfer: Transfer::new(
            body.clone(),
            Central { gm },
            duration / intervals as f64,
            intervals,
            initial,
            target,
            Actuation::full(&force, &moment)?,
        )?,
        body,
        weights: [force, moment],
        gm,
        constraints: Vec::new(),
        units: [1.0; 3],
    })
}

impl Varied {
    fn under(self, constraints: Vec<Constraint>) -> Self {
        Self {
            transfer: self.transfer.with_constraints_at_ends(&constraints),
            constraints,
            ..self
        }
    }

    /// Returns the transfer in its own units. Its optimal cost is the same number.
    pub fn stated(&self) -> Result<Transfer, ManeuverError> {
        let [l, m, t] = self.units;
        let (force, moment) = (m * l / (t * t), m * l * l / (t * t));
        let scaled = |state: &BodyState| BodyState {
            position: l * state.position,
            linear_momentum: (m * l / t) * state.linear_momentum,
            attitude: state.attitude,
            angular_momentum: (m * l * l / t) * state.angular_momentum,
        };
        let points = self.body.points().iter().map(|point| PointMass {
            mass: m * point.mass,
            position: l * point.position,
        });
        let inertia = Inertia::new(m * l * l * self.body.inertia().matrix())?;
        let transfer = &self.transfer;
        let target = transfer.target().state();
        let [w_force, w_moment] = self.weights;
        let rescaled = |constraint: &Constraint| -> Result<Constraint, ManeuverError> {
            Ok(if let Some(norm) = constraint.downcast_ref::<NormLimit>() {
                let load = match norm.place() {
                    Place::Position => force,
                    Place::Attitude => moment,
                };
                Constraint::commands(NormLimit::new(norm.place(), load * norm.limit())?)
            } else if let Some(sphere) = constraint.downcast_ref::<KeepOutSphere>() {
                let (center, radius) = (l * sphere.center(), l * sphere.radius());
                Constraint::state(KeepOutSphere::new(center, radius)?)
            } else if let Some(corridor) = constraint.downcast_ref::<Corridor>() {
                let (apex, axis) = (l * corridor.apex(), corridor.axis());
                Constraint::state(Corridor::new(apex, axis, corridor.half_angle())?)
            } else {
                constraint.clone()
            })
        };
        let constraints: Result<Vec<_>, _> = self.constraints.iter().map(rescaled).collect();
        let stated = Transfer::new(
            RigidBody::new(m * self.body.mass(), inertia, points.collect())?,
            Central {
                gm: self.gm * l * l * l / (t * t),
            },
            t * transfer.h(),
            transfer.intervals(),
            scaled(transfer.initial()),
            scaled(&target.unwrap_or(*transfer.initial())),
            Actuation::full(
                &(w_force / (force * force * t)),
                &(w_moment / (moment * moment * t)),
            )?,
        )?;
        Ok(stated.with_constraints_at_ends(&constraints?))
    }
}

/// Adds limits to the norms, in multiples of the estimated least feasible ones. Both limits are proportional to the
/// maxima of the plan without limits.
fn limited(random: &mut Random, free: Varied) -> Result<Varied, ManeuverError> {
    let multiple = random.uniform(1.01, 3.0);
    let orbits = free.gm > 0.0;
    let turns = !orbits || random.below(2) == 0;
    let settings = NewtonSettings::default();
    let Ok(plan) = solve(&free.transfer, Start::Cold, &settings, |_| true) else {
        return Ok(free);
    };
    let greatest = |norm: fn(&lgvi_dynamics::Load) -> f64| {
        let norms = plan.controls.iter().map(norm);
        norms.fold(0.0, f64::max)
    };
    let greatest = [
        greatest(|load| load.force.norm()),
        greatest(|load| load.moment.norm()),
    ];
    let limits = move |part: f64| -> Result<Vec<Constraint>, ManeuverError> {
        let [force, moment] = greatest.map(|most| part * most);
        let mut constraints = Vec::new();
        if orbits {
            let limit = NormLimit::new(Place::Position, force)?;
            constraints.push(Constraint::commands(limit));
        }
        if turns {
            let limit = NormLimit::new(Place::Attitude, moment)?;
            constraints.push(Constraint::commands(limit));
        }
        Ok(constraints)
    };
    let hopeless = free.clone().under(limits(HOPELESS)?);
    let least = match solve(&hopeless.transfer, Start::Cold, &settings, |_| true) {
        Err(PlanError::NotFound { violation, .. }) => HOPELESS * (1.0 + violation),
        Ok(_) => HOPELESS,
        Err(_) => 1.0,
    };
    Ok(free.under(limits((multiple * least).min(1.0))?))
}

/// Fraction of the maxima of the plan without limits at which no plan is expected to exist.
const HOPELESS: f64 = 0.2;

/// Adds a keep-out cone that contains neither end, around a direction close to the axis's path in the shortest
/// rotation.
fn past_a_cone(random: &mut Random, free: Varied) -> Result<Varied, ManeuverError> {
    let target = free.transfer.target().state();
    let [from, to] = [Some(*free.transfer.initial()), target]
        .map(|state| state.map_or(Matrix3::identity(), |state| state.attitude));
    let half_angle = random.uniform(0.15, 0.7);
    for _ in 0..1000 {
        let axis = random.direction();
        let turn = lgvi_lie::log(&from.tr_mul(&to));
        let middle = from * lgvi_lie::exp(&(random.uniform(0.3, 0.7) * turn)) * axis;
        let direction = (middle + 0.3 * half_angle * random.direction()).normalize();
        let off = |attitude: &Matrix3<f64>| (attitude * axis).dot(&direction);
        let clear = libm::cos(half_angle + 0.05);
        if off(&from) < clear && off(&to) < clear {
            let cone = KeepOutCone::new(axis, direction, half_angle)?;
            return Ok(free.under(vec![Constraint::state(cone)]));
        }
    }
    Ok(free)
}

/// Adds a keep-out sphere near the middle of the plan without it.
pub(super) fn past_a_sphere(random: &mut Random, free: Varied) -> Result<Varied, ManeuverError> {
    let Ok(plan) = solve(
        &free.transfer,
        Start::Cold,
        &NewtonSettings::default(),
        |_| true,
    ) else {
        return Ok(free);
    };
    let at = (random.uniform(0.3, 0.7) * free.transfer.intervals() as f64) as usize;
    let states = &plan.states;
    let ends = [states[0].position, states[states.len() - 1].position];
    let nearest = ends.map(|end| (states[at].position - end).norm());
    let radius = random.uniform(0.15, 0.5) * nearest[0].min(nearest[1]);
    let center = states[at].position + 0.5 * radius * random.direction();
    if ends.iter().any(|end| (end - center).norm() < 1.1 * radius) {
        return Ok(free);
    }
    let sphere = KeepOutSphere::new(center, radius)?;
    Ok(free.under(vec![Constraint::state(sphere)]))
}

/// Adds a corridor to the target that contains the start.
fn down_a_corridor(random: &mut Random, free: Varied) -> Result<Varied, ManeuverError> {
    let initial = free.transfer.initial().position;
    let target = free.transfer.target().state();
    let target = target.map_or(initial, |state| state.position);
    let along = (initial - target).normalize();
    let half_angle = random.uniform(0.1, 0.5);
    let off = random.uniform(0.3, 0.95) * half_angle;
    let across = along.cross(&random.direction()).normalize();
    let axis = libm::cos(off) * along + libm::sin(off) * across;
    let apex = target - random.uniform(0.02, 0.1) * (initial - target).norm() * axis;
    let corridor = Corridor::new(apex, axis, half_angle)?;
    Ok(free.under(vec![Constraint::state(corridor)]))
}
