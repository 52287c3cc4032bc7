//! Maneuvers past a sphere that hold with a probability although the start deviates.
//!
//! They are those of [`Family::Sphere`] without gravity, in open loop. There deviations of the position are isotropic, with the variance
//! `σ² + (σ_v t)²` at the time t, so that the constraint with the probability of two standard deviations is the sphere whose
//! radius is greater by twice the deviation. With the radius R of the family, the sphere has 0.7 R, and 0.05 R to 0.35 R are added at the end.

use lgvi_control::constraint::KeepOutSphere;
use lgvi_control::{Chances, Constraint, Transfer, Uncertainty};
use nalgebra::Vector3;

use super::ManeuverError;
use super::varied::{Family, Varied, crossing, past_a_sphere};
use crate::random::Random;

/// The probability of less than two standard deviations.
const CONFIDENCE: f64 = 0.977_249_868_051_820_8;

/// Its streams begin here, after those of the maneuvers without deviations.
const FIRST: u64 = 1 << 33;

/// A maneuver whose start deviates.
#[derive(Clone)]
pub struct Uncertain {
    /// The maneuver past the sphere, without deviations.
    pub certain: Varied,
    /// The optimal control problem.
    pub transfer: Transfer,
    /// The center of the sphere.
    pub center: Vector3<f64>,
    /// The radius that the sphere without deviations must have at the end of each step, for the same constraint.
    pub radii: Vec<f64>,
}

/// Returns maneuver `index` of `seed` with this number of steps.
pub fn uncertain(seed: u64, index: u64, intervals: usize) -> Result<Uncertain, ManeuverError> {
    let mut random = Random::new(seed, FIRST + index);
    let random = &mut random;
    let (certain, sphere) = loop {
        let free = crossing(random, Family::Sphere, intervals)?;
        let certain = past_a_sphere(random, free)?;
        let sphere = certain.constraints.first();
        let sphere = sphere.and_then(|sphere| sphere.downcast_ref::<KeepOutSphere>());
        if let Some(sphere) = sphere.copied() {
            break (certain, sphere);
        }
    };
    let (center, radius) = (sphere.center(), 0.7 * sphere.radius());
    let added = random.uniform(0.05, 0.35) * sphere.radius();
    let position = 0.5 * random.uniform(0.1, 0.5) * added;
    let h = certain.transfer.h();
    let velocity = (0.25 * added * added - position * position).sqrt() / (h * intervals as f64);
    let radii = (1..=intervals).map(|end| {
        let moved = velocity * h * end as f64;
        radius + 2.0 * (position * position + moved * moved).sqrt()
    });
    let uncertainty = Uncertainty {
        position,
        velocity,
        ..Uncertainty::default()
    };
    let constraint = Constraint::state(KeepOutSphere::new(center, radius)?);
    let transfer = certain.transfer.clone();
    Ok(Uncertain {
        transfer: transfer
            .with_constraints_at_ends(&[constraint])
            .with_chances(Chances::new(uncertainty, CONFIDENCE)?),
        radii: radii.collect(),
        center,
        certain,
    })
}
