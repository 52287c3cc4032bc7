use crate::gravity::{Interaction, Level, Partner};
use crate::skip::{Allowance, Skip};
use crate::{BodyState, RigidBody};

/// Hysteresis of levels, in multiples of the required distance: a pair is simplified beyond the first, and remains so
/// until it is closer than the second.
const COMFORT: f64 = 1.25;
const CARE: f64 = 1.05;

/// The levels that omit something.
const BELOW: [Level; 3] = [Level::Dropped, Level::Monopole, Level::Quadrupole];

/// Limits of halvings and doublings in the search for a distance.
const HALVINGS: u32 = 30;
const DOUBLINGS: u32 = 1000;

/// An interaction, and the distances from which it may be simplified.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Term {
    /// Index of its gravity model.
    pub(super) gravity: usize,
    pub(super) interaction: Interaction,
    /// Distances from which each level below the full one is sufficient, or infinity if it never is.
    pub(super) limits: [f64; 3],
    pub(super) level: Level,
}

impl Term {
    pub(super) fn new(gravity: usize, interaction: Interaction, skip: Skip, share: f64) -> Self {
        let limit = |level: Level| {
            if interaction.exact <= level {
                return 0.0;
            }
            let saves = interaction.costs[level as usize] < interaction.costs[Level::Full as usize];
            match (skip, interaction.partner) {
                (Skip::Within(_), Partner::Source(_)) if level == Level::Dropped => f64::INFINITY,
                (Skip::Within(allowance), Partner::Body(_) | Partner::Source(_)) if saves => {
                    distance(&interaction, level, share, &allowance)
                }
                _ => f64::INFINITY,
            }
        };
        Self {
            gravity,
            interaction,
            limits: BELOW.map(limit),
            level: Level::Full,
        }
    }

    /// The distance between the partners.
    pub(super) fn distance(&self, states: &[BodyState]) -> f64 {
        let x = states[self.interaction.body].position;
        match self.interaction.partner {
            Partner::Body(other) => (x - states[other].position).norm(),
            Partner::Source(place) => (x - place).norm(),
            Partner::Field => 0.0,
        }
    }

    /// Returns true if the level depends on the distance.
    pub(super) fn varies(&self) -> bool {
        self.limits
            .iter()
            .any(|limit| *limit > 0.0 && limit.is_finite())
    }

    /// The lowest level that this distance allows.
    fn at(&self, distance: f64) -> Level {
        let allowed = |limit: f64| limit.is_finite() && distance >= limit;
        let mut levels = BELOW.into_iter().zip(self.limits);
        let lowest = levels.find(|(_, limit)| allowed(*limit));
        lowest.map_or(Level::Full, |(level, _)| level)
    }

    /// Returns true if the distance is shorter than the current level allows.
    pub(super) fn is_breached(&self, distance: f64) -> bool {
        self.level < self.at(distance)
    }

    /// The suitable level for this distance, given the current one, if a step may reduce the distance by `stride`.
    pub(super) fn suited(&self, distance: f64, stride: f64) -> Level {
        let least = self.at(distance / CARE);
        self.level
            .clamp(least, self.at((distance - stride) / COMFORT).max(least))
    }

    /// The initial level.
    pub(super) fn first(&self, distance: f64) -> Level {
        self.at(distance / COMFORT)
    }

    /// The change of distance after which it may be shorter than the level allows, and the change after which a lower
    /// level may be suitable.
    pub(super) fn slack(&self, distance: f64, stride: f64) -> [f64; 2] {
        let finite = |limit: &&f64| **limit > 0.0 && limit.is_finite();
        let level = self.level as usize;
        let (below, above) = self.limits.split_at(level.min(self.limits.len()));
        let margin = above.first().filter(finite);
        // Lower levels come first and have larger limits, so the nearest one is last.
        let lower = below.iter().rev().find(finite);
        [
            margin.map_or(f64::INFINITY, |limit| distance - limit),
            lower.map_or(f64::INFINITY, |limit| {
                (COMFORT * limit + stride - distance).max((CARE - 1.0) * limit)
            }),
        ]
    }

    /// A lower bound of the distance within a step. Assumes that the relative speed within the step does not exceed
    /// that at both ends.
    ///
    /// A path of length L from `p` to `q` lies within an ellipsoid with these foci, and so within `½ √(L² − |q − p|²)`
    /// of the segment between them.
    pub(super) fn nearest(&self, bodies: &[RigidBody], ends: [&[BodyState]; 2], h: f64) -> f64 {
        let body = self.interaction.body;
        let [(p, v), (q, w)] = ends.map(|states| {
            let (x, v) = (states[body].position, states[body].velocity(&bodies[body]));
            match self.interaction.partner {
                Partner::Body(other) => {
                    let there = &states[other];
                    (x - there.position, v - there.velocity(&bodies[other]))
                }
                Partner::Source(place) => (x - place, v),
                Partner::Field => (x, v),
            }
        });
        let way = q - p;
        let squared = way.norm_squared();
        let length = h * h * v.norm_squared().max(w.norm_squared());
        let along = if squared > 0.0 {
            (-p.dot(&way) / squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (p + along * way).norm() - 0.5 * (length - squared).max(0.0).sqrt()
    }
}

/// The smallest distance from which a level neglects at most `share` of the allowance, or infinity if it does not
/// exist.
fn distance(interaction: &Interaction, level: Level, share: f64, allowance: &Allowance) -> f64 {
    let Some(remainder) = &interaction.remainder else {
        return f64::INFINITY;
    };
    let suffices = |distance: f64| {
        let sides = remainder.neglect(level, distance);
        sides.iter().all(|side| allowance.part(side) <= share)
    };
    let mut far = allowance.length;
    let mut doublings = 0;
    while !suffices(far) {
        far *= 2.0;
        doublings += 1;
        if doublings == DOUBLINGS || !far.is_finite() {
            return f64::INFINITY;
        }
    }
    let mut near = 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (near + far);
        if suffices(middle) {
            far = middle;
        } else {
            near = middle;
        }
    }
    far
}
