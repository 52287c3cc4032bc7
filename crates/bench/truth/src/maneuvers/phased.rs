//! Maneuvers by one-sided thrusters in three phases: away, through a sphere, and to the target.
//!
//! They are those [by thrusters](super::thrusted) at least energy. The middle phase begins after 35 to 50 % of the steps and
//! lasts for 15 to 25 % of them. The sphere is about a point halfway that is off the straight line by up to a fifth of its length, and
//! its radius is 0.1 to 0.25 of that length. In the last phase two or three of the thrusters are off.

use std::ops::Range;

use lgvi_control::Constraint;
use lgvi_control::constraint::KeepInSphere;
use nalgebra::Vector3;

use super::ManeuverError;
use super::thrusted::{Thrusted, thrusted};
use crate::random::Random;

/// Its streams begin here, after those of the maneuvers themselves.
const FIRST: u64 = 1 << 32;

/// A maneuver by thrusters in phases.
#[derive(Clone)]
pub struct Phased {
    /// The maneuver; its transfer has the phases.
    pub whole: Thrusted,
    /// The steps of the middle phase.
    pub middle: Range<usize>,
    /// The center and the radius of the sphere that holds in it.
    pub sphere: (Vector3<f64>, f64),
    /// The thrusters that are off after it.
    pub off: Vec<usize>,
}

/// Returns maneuver `index` of `seed` with this number of steps.
pub fn phased(seed: u64, index: u64, intervals: usize) -> Result<Phased, ManeuverError> {
    let whole = thrusted(seed, 2 * index, intervals)?;
    let transfer = &whole.transfer;
    let mut random = Random::new(seed, FIRST + index);
    let part = |part: f64| (part * intervals as f64).round() as usize;
    let begin = part(random.uniform(0.35, 0.5));
    let middle = begin..begin + part(random.uniform(0.15, 0.25));
    let target = transfer.target().state().unwrap_or(*transfer.initial());
    let way = target.position - transfer.initial().position;
    let halfway = transfer.initial().position + 0.5 * way;
    let center = halfway + random.uniform(0.0, 0.2) * way.norm() * random.direction();
    let radius = random.uniform(0.1, 0.25) * way.norm();
    let mut on: Vec<_> = (0..whole.prices.len()).collect();
    let count = 2 + random.below(2);
    let off = (0..count).map(|_| on.swap_remove(random.below(on.len())));
    let off: Vec<_> = off.collect();

    let inside = Constraint::state(KeepInSphere::new(center, radius)?).during(middle.clone())?;
    let transfer = transfer
        .clone()
        .with_constraints_at_ends(&[whole.limits.clone(), inside])
        .without_commands(middle.end..intervals, &off)?;
    Ok(Phased {
        whole: Thrusted { transfer, ..whole },
        middle,
        sphere: (center, radius),
        off,
    })
}
