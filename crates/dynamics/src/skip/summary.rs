use super::{Levels, Skip};
use crate::gravity::{Interaction, Level};
use crate::integrator::Rotor;
use crate::{BodyState, Method, Mobility, System};

/// Summary of the computed and omitted parts of a system at the start of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Summary of each body.
    pub bodies: Vec<BodySummary>,
    /// Summary of each interaction, ordered by gravity model, without models that cannot be decomposed.
    pub interactions: Vec<InteractionSummary>,
    /// Approximate cost of a gravity evaluation, in full and with omissions, in multiples of a point in a central
    /// field.
    pub costs: [f64; 2],
}

/// The computed parts of a body's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BodySummary {
    /// Translation of the body.
    pub translation: Translation,
    /// Rotation of the body.
    pub rotation: Rotation,
    /// True if a gravitational moment is computed.
    pub moment: bool,
}

/// The computation of a body's translation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Translation {
    /// Follows the forces on the body.
    Forced,
    /// Uniform: gravity exerts no force.
    Uniform,
    /// On a prescribed path.
    Given,
    /// None: the body is held.
    Held,
}

/// The computation of a body's rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rotation {
    /// Computed in every stage of a step.
    Staged,
    /// No moment acts, and the rotation is computed once per step in closed form.
    Once,
    /// No moment acts and the body is at rest. Nothing is computed until a control rotates it.
    AtRest,
    /// Prescribed.
    Given,
    /// None: the body is held.
    Held,
}

/// The computed parts of an interaction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InteractionSummary {
    /// Index of its gravity model.
    pub gravity: usize,
    /// The interaction.
    pub interaction: Interaction,
    /// Level at which it is computed at the start.
    pub level: Level,
    /// Distances from which each level below the full one is sufficient, or infinity if it never is.
    pub limits: [f64; 3],
    /// Upper bound of its contribution to the error at the end of the run, given the measured growth, if the distance
    /// does not decrease.
    pub bound: f64,
}

impl Summary {
    /// Creates the summary of `system` in `states` (one per body), integrated by `method`.
    pub fn new(system: &mut System, states: &[BodyState], method: Method, skip: Skip) -> Self {
        let levels = Levels::new(system, states, skip);
        let interactions = levels.iter().flat_map(|levels| levels.terms().iter());
        let interactions: Vec<_> = interactions
            .map(|term| {
                let bound = match (skip, term.interaction.remainder) {
                    (Skip::Within(allowance), Some(remainder))
                        if term.level < term.interaction.exact =>
                    {
                        let sides = remainder.neglect(term.level, term.distance(states));
                        let parts = sides.map(|side| allowance.part(&side));
                        allowance.tolerance * parts[0].max(parts[1])
                    }
                    _ => 0.0,
                };
                InteractionSummary {
                    gravity: term.gravity,
                    interaction: term.interaction,
                    level: term.level,
                    limits: term.limits,
                    bound,
                }
            })
            .collect();
        let full = system.cost();
        let saved = interactions.iter().map(|one| {
            let costs = one.interaction.costs;
            costs[Level::Full as usize] - costs[one.level as usize]
        });
        Self {
            bodies: bodies(system, states, method, levels.as_ref()),
            costs: [full, (full - saved.sum::<f64>()).max(0.0)],
            interactions,
        }
    }

    /// Upper bound of the error of all omissions at the end of the run, given the measured growth, if distances do not
    /// decrease.
    pub fn bound(&self) -> f64 {
        let mut sums = vec![0.0; self.bodies.len()];
        for one in &self.interactions {
            sums[one.interaction.body] += one.bound;
            if let Some(other) = one.interaction.other() {
                sums[other] += one.bound;
            }
        }
        sums.into_iter().fold(0.0, f64::max)
    }
}

fn bodies(
    system: &System,
    states: &[BodyState],
    method: Method,
    levels: Option<&Levels>,
) -> Vec<BodySummary> {
    let all = system.bodies();
    let selection = levels.map(|levels| levels.selection(all));
    let selection = selection.filter(|selection| selection.is_partial);
    let each = all.iter().zip(states).enumerate();
    each.map(|(index, (body, state))| {
        let acts = |gravity: &Vec<crate::gravity::Kept>| {
            gravity
                .iter()
                .any(|kept| kept.body == index || kept.other == index)
        };
        let (forced, coasts) = match &selection {
            Some(selection) => {
                let acts = |kept: &Option<Vec<_>>| kept.as_ref().is_none_or(acts);
                (selection.kept.iter().any(acts), selection.coasting[index])
            }
            None => (!system.is_free(), system.is_free()),
        };
        let (translation, rotation) = match body.mobility() {
            Mobility::Fixed => (Translation::Held, Rotation::Held),
            Mobility::Driven(_) => (Translation::Given, Rotation::Given),
            mobility => {
                let translation = match (mobility, forced || body.drag().is_some()) {
                    (Mobility::Pivoted, _) => Translation::Held,
                    (_, true) => Translation::Forced,
                    (_, false) => Translation::Uniform,
                };
                let rests = state
                    .angular_momentum
                    .iter()
                    .all(|component| *component == 0.0);
                let uncoupled = selection.is_some() && coasts;
                let rotation = match (uncoupled && method.drifts(), rests) {
                    (true, true) => Rotation::AtRest,
                    (true, false) if turns_once(method) => Rotation::Once,
                    _ => Rotation::Staged,
                };
                (translation, rotation)
            }
        };
        BodySummary {
            translation,
            rotation,
            moment: forced && !coasts && !body.mobility().is_given(),
        }
    })
    .collect()
}

/// Returns true if the method computes the rotation of a body without moments once per step.
fn turns_once(method: Method) -> bool {
    matches!(
        method,
        Method::Composition {
            rotor: Rotor::Exact,
            ..
        } | Method::Nystrom { .. }
            | Method::WisdomHolman { .. }
    )
}
