use std::f64::consts::TAU;

use lgvi_dynamics::gravity::{Central, Field};
use lgvi_dynamics::{BodyState, Inertia, PointMass, RigidBody};
use nalgebra::{Matrix3, Vector3};

use super::{Class, Maneuver, ManeuverError, finish, pairs};
use crate::kepler::Orbit;
use crate::random::Random;

/// Draws a maneuver from one orbit to another.
pub(super) fn to_orbit(random: &mut Random, intervals: usize) -> Result<Maneuver, ManeuverError> {
    let mass = random.log_uniform(0.5, 2.0);
    let body = if random.below(2) == 0 {
        dumbbell(random, mass)?
    } else {
        let axes = Vector3::from_fn(|_, _| random.log_uniform(0.02, 0.2));
        let spread = axes.component_mul(&axes) / 3.0;
        let moments = Vector3::from_element(spread.sum()) - spread;
        let inertia = Inertia::principal((mass * moments).into())?;
        RigidBody::new(mass, inertia, pairs(mass, &Matrix3::identity(), &spread))?
    };
    let (orbits, duration) = loop {
        let orbits = [Orbit::random(random), Orbit::random(random)];
        let duration = random.uniform(0.1, 0.7) * TAU / orbits[0].rate().max(orbits[1].rate());
        let periapsis = orbits[0].periapsis().min(orbits[1].periapsis());
        if closest_approach(&orbits, duration) > 0.5 * periapsis {
            break (orbits, duration);
        }
    };
    let aligned = random.below(2) == 0;
    let ends = orbits.map(|orbit| {
        let [along, across, normal] = orbit.axes();
        let (attitude, spin) = if aligned {
            let attitude = Matrix3::from_columns(&[along, across, normal]);
            (attitude, Vector3::new(0.0, 0.0, orbit.rate()))
        } else {
            let spin = random.uniform(0.0, orbit.rate()) * random.direction();
            (random.rotation(), spin)
        };
        BodyState::from_velocities(&body, orbit.position, orbit.velocity, attitude, spin)
    });
    let gravity: Vec<Box<dyn Field>> = vec![Box::new(Central { gm: 1.0 })];
    let h = duration / intervals as f64;
    finish(
        random,
        Class::OrbitToOrbit,
        body,
        gravity,
        h,
        intervals,
        ends,
    )
}

/// Draws two spheres on a massless rod along body x.
fn dumbbell(random: &mut Random, mass: f64) -> Result<RigidBody, ManeuverError> {
    let length = random.log_uniform(0.05, 0.4);
    let radius = length * random.log_uniform(0.1, 0.5);
    spheres_on_a_rod(mass, length, 0.4 * mass * radius * radius)
}

/// Returns two spheres on a massless rod along body x, with the moment of inertia `axial` about it.
pub(super) fn spheres_on_a_rod(
    mass: f64,
    length: f64,
    axial: f64,
) -> Result<RigidBody, ManeuverError> {
    let transverse = axial + 0.25 * mass * length * length;
    let inertia = Inertia::principal([axial, transverse, transverse])?;
    let arm = Vector3::new(0.5 * length, 0.0, 0.0);
    let points = [arm, -arm].map(|position| PointMass {
        mass: 0.5 * mass,
        position,
    });
    Ok(RigidBody::new(mass, inertia, points.to_vec())?)
}

/// Returns the least distance from the origin of the cubic in time through both ends, sampled.
fn closest_approach([from, to]: &[Orbit; 2], duration: f64) -> f64 {
    const SAMPLES: u32 = 100;
    let at = |sample: u32| {
        let s = f64::from(sample) / f64::from(SAMPLES);
        let (t, rest) = (s * duration, (1.0 - s) * duration);
        let weight = s * s * (3.0 - 2.0 * s);
        let start = from.position * (1.0 - weight) + from.velocity * (t * (1.0 - s) * (1.0 - s));
        (start + to.position * weight - to.velocity * (rest * s * s)).norm()
    };
    (0..=SAMPLES).map(at).fold(f64::INFINITY, f64::min)
}
