use nalgebra::Vector3;

use super::Skip;
use super::term::Term;
use crate::gravity::{Interaction, Kept, Level, Partner};
use crate::system::Selection;
use crate::{BodyState, RigidBody, System};

/// The interactions of a system, each at the level that its distance allows.
///
/// Distances are looked at only when the bodies have moved far enough for one of them to matter: no distance changes by
/// more than twice the greatest displacement of a body or source, measured against their common motion.
#[derive(Clone, Debug)]
pub(crate) struct Watch {
    terms: Vec<Term>,
    /// Which gravities can be taken apart.
    apart: Vec<bool>,
    /// Where the bodies were when all distances were last looked at.
    seen: Vec<Vector3<f64>>,
    /// How far any distance may change from there until another level suits.
    slack: f64,
    /// Whether sources with a place take part.
    sources: bool,
    switches: u64,
}

impl Watch {
    /// Of `system` in `states`; none where nothing is to be left out.
    pub(crate) fn new(system: &System, states: &[BodyState], skip: Skip) -> Option<Self> {
        if skip == Skip::Nothing {
            return None;
        }
        let bodies = system.bodies();
        let each = system.gravity().iter();
        let interactions: Vec<_> = each.map(|gravity| gravity.interactions(bodies)).collect();
        let apart = interactions.iter().map(Option::is_some).collect();
        let all = interactions.into_iter().enumerate();
        let all: Vec<_> = all
            .flat_map(|(gravity, some)| some.into_iter().flatten().map(move |one| (gravity, one)))
            .collect();
        let costs = costs(bodies.len(), all.iter().map(|(_, one)| one));
        let terms: Vec<_> = all
            .into_iter()
            .map(|(gravity, one)| {
                Term::new(
                    gravity,
                    one,
                    masses(bodies, &one),
                    skip,
                    share(&one, &costs),
                )
            })
            .collect();
        let sources = terms
            .iter()
            .any(|term| term.varies() && matches!(term.interaction.partner, Partner::Source(_)));
        let mut watch = Self {
            terms,
            apart,
            seen: Vec::new(),
            slack: f64::INFINITY,
            sources,
            switches: 0,
        };
        watch.begin(states);
        Some(watch)
    }

    /// Begins anew from `states`.
    pub(crate) fn begin(&mut self, states: &[BodyState]) {
        for term in &mut self.terms {
            term.level = term.first(term.distance(states));
        }
        self.see(states);
    }

    /// Gives all interactions of which `states` are too near the level that they need; whether there are any.
    #[inline]
    pub(crate) fn is_breached(&mut self, states: &[BodyState]) -> bool {
        !self.is_quiet(states) && self.mend(states)
    }

    /// Gives all interactions the level that suits them in `states`; whether any changes.
    #[inline]
    pub(crate) fn review(&mut self, states: &[BodyState]) -> bool {
        !self.is_quiet(states) && self.suit(states)
    }

    /// Whether any level depends on a distance.
    pub(crate) fn varies(&self) -> bool {
        self.terms.iter().any(Term::varies)
    }

    /// Changes of level so far.
    pub(crate) fn switches(&self) -> u64 {
        self.switches
    }

    /// Whether anything is left out now that makes a difference.
    pub(super) fn may_leave_out(&self) -> bool {
        self.terms
            .iter()
            .any(|term| term.level < term.interaction.exact)
    }

    pub(super) fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Whether no distance can have changed by as much as matters.
    fn is_quiet(&self, states: &[BodyState]) -> bool {
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
        2.0 * most.sqrt() < self.slack
    }

    #[cold]
    fn mend(&mut self, states: &[BodyState]) -> bool {
        let before = self.switches;
        for term in &mut self.terms {
            let distance = term.distance(states);
            if term.is_breached(distance) {
                term.level = term.suited(distance);
                self.switches += 1;
            }
        }
        self.switches > before
    }

    #[cold]
    fn suit(&mut self, states: &[BodyState]) -> bool {
        let before = self.switches;
        for term in &mut self.terms {
            let suited = term.suited(term.distance(states));
            self.switches += u64::from(suited != term.level);
            term.level = suited;
        }
        self.see(states);
        self.switches > before
    }

    fn see(&mut self, states: &[BodyState]) {
        self.seen.clear();
        self.seen.extend(states.iter().map(|state| state.position));
        let slacks = self.terms.iter().filter(|term| term.varies());
        self.slack = slacks
            .map(|term| term.slack(term.distance(states)))
            .fold(f64::INFINITY, f64::min);
    }

    /// What is to be computed; none where that is everything.
    pub(crate) fn selection(&self, bodies: &[RigidBody]) -> Option<Selection> {
        let mut kept: Vec<_> = self
            .apart
            .iter()
            .map(|apart| apart.then(Vec::new))
            .collect();
        let opaque = self.apart.iter().any(|apart| !apart);
        let given = bodies.iter().map(|body| body.mobility().is_given());
        let mut coasting: Vec<_> = given.map(|given| !given && !opaque).collect();
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
                    masses: term.masses,
                });
            }
        }
        let all = self.terms.iter().all(|term| term.level == Level::Full);
        let none = coasting.iter().all(|coasting| !coasting);
        (!(all && none)).then_some(Selection { kept, coasting })
    }
}

/// The mass that a source acts on, or the product of both.
fn masses(bodies: &[RigidBody], interaction: &Interaction) -> f64 {
    let mass = |body: usize| bodies[body].attracted_mass();
    let other = interaction.other().map_or(1.0, mass);
    mass(interaction.body) * other
}

/// What the interactions of each body cost that may leave something out.
fn costs<'a>(bodies: usize, all: impl Iterator<Item = &'a Interaction>) -> Vec<f64> {
    let mut costs = vec![0.0; bodies];
    for interaction in all {
        for (body, moves) in sides(interaction) {
            costs[body] += if moves { full_cost(interaction) } else { 0.0 };
        }
    }
    costs
}

/// The part of what either body may neglect that is for this interaction: its part of the cost.
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

/// The two, and whether each is moved by what may be left out.
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
