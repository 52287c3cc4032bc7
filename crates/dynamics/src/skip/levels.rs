use nalgebra::Vector3;

use super::Skip;
use super::term::Term;
use crate::gravity::{Interaction, Kept, Level, Partner};
use crate::system::Selection;
use crate::{BodyState, RigidBody, System};

/// The interactions of a system, each at the level that its distance allows.
///
/// Distances are recomputed only when the bodies have moved far enough for a distance to matter. No distance changes by
/// more than twice the largest displacement of a body or source relative to their common motion.
#[derive(Clone, Debug)]
pub(crate) struct Levels {
    terms: Vec<Term>,
    /// True for each gravity model that can be decomposed into interactions.
    apart: Vec<bool>,
    /// Positions of the bodies when all distances were last computed.
    seen: Vec<Vector3<f64>>,
    /// Change of each distance after which it may be too short for its level, and the smallest of these changes.
    margins: Vec<f64>,
    margin: f64,
    /// Change of any distance after which another level may be suitable.
    slack: f64,
    /// Largest reduction of a distance in a step so far.
    stride: f64,
    /// True if any interaction with a source at a position depends on its distance.
    sources: bool,
    /// True if a distance has been too short since the last query.
    breached: bool,
    switches: u64,
}

impl Levels {
    /// Creates the levels of `system` in `states`, or `None` if nothing is to be omitted.
    pub(crate) fn new(system: &mut System, states: &[BodyState], skip: Skip) -> Option<Self> {
        if skip == Skip::Nothing {
            return None;
        }
        let interactions = system.interactions();
        let bodies = system.bodies();
        let apart = interactions.iter().map(Option::is_some).collect();
        let all = interactions.into_iter().enumerate();
        let all: Vec<_> = all
            .flat_map(|(gravity, some)| some.into_iter().flatten().map(move |one| (gravity, one)))
            .collect();
        let costs = costs(bodies.len(), all.iter().map(|(_, one)| one));
        let terms: Vec<_> = all
            .into_iter()
            .map(|(gravity, one)| Term::new(gravity, one, skip, share(&one, &costs)))
            .collect();
        let sources = terms
            .iter()
            .any(|term| term.varies() && matches!(term.interaction.partner, Partner::Source(_)));
        let mut levels = Self {
            terms,
            apart,
            seen: Vec::new(),
            margins: Vec::new(),
            margin: f64::INFINITY,
            slack: f64::INFINITY,
            stride: 0.0,
            sources,
            breached: false,
            switches: 0,
        };
        levels.reset(states);
        Some(levels)
    }

    /// Restarts from `states`.
    pub(crate) fn reset(&mut self, states: &[BodyState]) {
        for term in &mut self.terms {
            term.level = term.first(term.distance(states));
        }
        self.remember(states);
    }

    /// Checks the distances at the states from which a step is computed.
    #[inline]
    pub(crate) fn check_states(&mut self, states: &[BodyState]) {
        let moved = self.displacement(states);
        if 2.0 * moved >= self.margin {
            self.raise(2.0 * moved, |term| term.distance(states));
        }
    }

    /// Checks the distances along a step between two states, made in one piece.
    pub(crate) fn check_step(&mut self, bodies: &[RigidBody], ends: [&[BodyState]; 2], h: f64) {
        let (moved, way) = self.path(bodies, ends, h.abs());
        self.stride = self.stride.max(2.0 * way);
        if 2.0 * moved >= self.margin {
            self.raise(2.0 * moved, |term| term.nearest(bodies, ends, h));
        }
    }

    /// Returns true if a distance has been too short since the last query. The levels of these interactions have been
    /// raised as needed.
    pub(crate) fn take_breach(&mut self) -> bool {
        std::mem::take(&mut self.breached)
    }

    /// Chooses suitable levels for all interactions in `states` at the end of a step. Returns true if any level
    /// changed.
    #[inline]
    pub(crate) fn update(&mut self, states: &[BodyState]) -> bool {
        2.0 * self.displacement(states) >= self.slack && self.choose(states)
    }

    /// Returns true if any level depends on a distance.
    pub(crate) fn varies(&self) -> bool {
        self.terms.iter().any(Term::varies)
    }

    /// The number of changes of level so far.
    pub(crate) fn switches(&self) -> u64 {
        self.switches
    }

    /// Returns true if an interaction is currently below its exact level.
    pub(super) fn may_leave_out(&self) -> bool {
        self.terms
            .iter()
            .any(|term| term.level < term.interaction.exact)
    }

    pub(super) fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// The largest displacement since all distances were computed, or infinity if it is not a number.
    fn displacement(&self, states: &[BodyState]) -> f64 {
        let per_body = 1.0 / states.len() as f64;
        let moved = |(state, seen): (&BodyState, &Vector3<f64>)| state.position - seen;
        let each = || states.iter().zip(&self.seen).map(moved);
        let common = per_body * each().sum::<Vector3<f64>>();
        let mut most = if self.sources {
            common.norm_squared()
        } else {
            0.0
        };
        for displacement in each() {
            most = most.max((displacement - common).norm_squared());
        }
        if common.norm_squared().is_finite() {
            most.sqrt()
        } else {
            f64::INFINITY
        }
    }

    /// The largest displacement at any time within a step with the given ends and duration, and the length of the
    /// longest path. Assumes that no body is faster within the step, relative to the common motion, than at one of its
    /// ends. A path of length L from `p` to `q` stays within the distance `½ (|p| + |q| + L)` of the origin.
    fn path(&self, bodies: &[RigidBody], ends: [&[BodyState]; 2], h: f64) -> (f64, f64) {
        let per_body = 1.0 / bodies.len() as f64;
        let at = |index: usize| {
            ends.map(|states| {
                let state = &states[index];
                (
                    state.position - self.seen[index],
                    state.velocity(&bodies[index]),
                )
            })
        };
        let mut common = [(Vector3::zeros(), Vector3::zeros()); 2];
        for index in 0..bodies.len() {
            for ((x, v), (dx, dv)) in common.iter_mut().zip(at(index)) {
                *x += per_body * dx;
                *v += per_body * dv;
            }
        }
        let way = |[(p, v), (q, w)]: [(Vector3<f64>, Vector3<f64>); 2]| {
            let length = h * v.norm_squared().max(w.norm_squared()).sqrt();
            (0.5 * (p.norm() + q.norm() + length), length)
        };
        let mut most = if self.sources {
            way(common)
        } else {
            (0.0, 0.0)
        };
        for index in 0..bodies.len() {
            let [(p, v), (q, w)] = at(index);
            let [(x, u), (y, z)] = common;
            let (moved, length) = way([(p - x, v - u), (q - y, w - z)]);
            most = (most.0.max(moved), most.1.max(length));
        }
        most
    }

    /// Raises interactions to the level that they need at these distances, where a change of distance by `moved` can
    /// have made them too short.
    #[cold]
    fn raise(&mut self, moved: f64, distance: impl Fn(&Term) -> f64) {
        let near = self.terms.iter_mut().zip(&self.margins);
        for (term, _) in near.filter(|(_, margin)| **margin <= moved) {
            let distance = distance(term);
            if term.is_breached(distance) {
                term.level = term.suited(distance, 0.0);
                self.breached = true;
                self.switches += 1;
            }
        }
    }

    #[cold]
    fn choose(&mut self, states: &[BodyState]) -> bool {
        let before = self.switches;
        for term in &mut self.terms {
            let suited = term.suited(term.distance(states), self.stride);
            self.switches += u64::from(suited != term.level);
            term.level = suited;
        }
        self.remember(states);
        self.switches > before
    }

    fn remember(&mut self, states: &[BodyState]) {
        self.seen.clear();
        self.seen.extend(states.iter().map(|state| state.position));
        self.margins.clear();
        self.margin = f64::INFINITY;
        self.slack = f64::INFINITY;
        for term in &self.terms {
            let [margin, lower] = if term.varies() {
                term.slack(term.distance(states), self.stride)
            } else {
                [f64::INFINITY; 2]
            };
            self.margins.push(margin);
            self.margin = self.margin.min(margin);
            self.slack = self.slack.min(margin).min(lower);
        }
        self.stride = 0.0;
        self.breached = false;
    }

    /// The interactions to be computed.
    pub(crate) fn selection(&self, bodies: &[RigidBody]) -> Selection {
        let mut selection = Selection::default();
        self.select(bodies, &mut selection);
        selection
    }

    /// Sets `selection` to the interactions to be computed. If it was set by this method before, nothing is allocated.
    pub(crate) fn select(&self, bodies: &[RigidBody], selection: &mut Selection) {
        let Selection {
            is_partial,
            kept,
            coasting,
        } = selection;
        if kept.len() != self.apart.len() {
            let all = |gravity| {
                let terms = self.terms.iter().filter(|term| term.gravity == gravity);
                Vec::with_capacity(terms.count())
            };
            let apart = self.apart.iter().enumerate();
            *kept = apart
                .map(|(gravity, apart)| apart.then(|| all(gravity)))
                .collect();
        }
        kept.iter_mut().flatten().for_each(Vec::clear);
        let opaque = self.apart.iter().any(|apart| !apart);
        let given = bodies.iter().map(|body| body.mobility().is_given());
        coasting.clear();
        coasting.extend(given.map(|given| !given && !opaque));
        for term in &self.terms {
            let body = term.interaction.body;
            let other = term.interaction.other().unwrap_or(body);
            if term.level > Level::Monopole {
                let [first, second] = term.interaction.moments;
                coasting[body] &= !first;
                coasting[other] &= !second;
            }
            if let (Some(kept), true) = (&mut kept[term.gravity], term.level > Level::Dropped) {
                kept.push(Kept {
                    body,
                    other,
                    level: term.level,
                    masses: term.interaction.masses(bodies),
                });
            }
        }
        let all = self.terms.iter().all(|term| term.level == Level::Full);
        let none = coasting.iter().all(|coasting| !coasting);
        *is_partial = !(all && none);
    }
}

/// The total cost, for each body, of the interactions that may be simplified.
fn costs<'a>(bodies: usize, all: impl Iterator<Item = &'a Interaction>) -> Vec<f64> {
    let mut costs = vec![0.0; bodies];
    for interaction in all {
        for (body, moves) in sides(interaction) {
            costs[body] += if moves { full_cost(interaction) } else { 0.0 };
        }
    }
    costs
}

/// The share of this interaction in the allowance of its bodies, in proportion to its cost.
fn share(interaction: &Interaction, costs: &[f64]) -> f64 {
    let moved = sides(interaction).into_iter().filter(|(_, moves)| *moves);
    let most = moved.map(|(body, _)| costs[body]).fold(0.0, f64::max);
    if most > 0.0 {
        full_cost(interaction) / most
    } else {
        0.0
    }
}

fn full_cost(interaction: &Interaction) -> f64 {
    interaction.costs[Level::Full as usize]
}

/// The two bodies of an interaction, each with a flag that is true if omissions affect its motion.
fn sides(interaction: &Interaction) -> [(usize, bool); 2] {
    let some = match interaction.partner {
        Partner::Body(_) => interaction.exact > Level::Dropped,
        Partner::Source(_) => interaction.exact > Level::Monopole,
        Partner::Field => false,
    };
    let remainder = interaction.remainder.filter(|_| some);
    let [moves, recoils] = remainder.map_or([false; 2], |remainder| remainder.moves());
    let body = interaction.body;
    [
        (body, moves),
        (interaction.other().unwrap_or(body), recoils),
    ]
}
