use super::{Levels, Skip};
use crate::gravity::{Interaction, Level};
use crate::integrator::Rotor;
use crate::{BodyState, Method, Mobility, System};

/// What of a system is computed at the start of a run, and what is left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Of each body.
    pub bodies: Vec<BodySummary>,
    /// Of each interaction, those of one gravity after those of another; none of what cannot be taken apart.
    pub interactions: Vec<InteractionSummary>,
    /// What an evaluation of gravity costs in full and as it is, in multiples of a point in a central field, roughly.
    pub costs: [f64; 2],
}

/// What is computed of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BodySummary {
    /// How it moves.
    pub translation: Translation,
    /// How it turns.
    pub rotation: Rotation,
    /// Whether gravity has a moment on it that is computed.
    pub moment: bool,
}

/// What is computed of a body's translation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Translation {
    /// By the forces on it.
    Forced,
    /// Uniformly: gravity has no force on it.
    Uniform,
    /// On its path, which is given.
    Given,
    /// Not at all, it is held.
    Held,
}

/// What is computed of a body's rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rotation {
    /// It turns in every stage of a step.
    Staged,
    /// No moment acts, and it turns once a step in closed form.
    Once,
    /// No moment acts and it does not turn: nothing, until a control turns it.
    AtRest,
    /// As it is given.
    Given,
    /// Not at all, it is held.
    Held,
}

/// What is computed of an interaction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InteractionSummary {
    /// Which gravity it is part of.
    pub gravity: usize,
    /// The interaction.
    pub interaction: Interaction,
    /// How much of it is computed at the start.
    pub level: Level,
    /// From which distance on each level below the full one will do; infinite for never.
    pub limits: [f64; 3],
    /// What it adds at most to the error at the end of the run, by the measured growth, if the distance stays as it is at least.
    pub bound: f64,
}

impl Summary {
    /// Of `system` in `states` (one a body), flown by `method`.
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

    /// The error that all that is left out makes at the end of the run at most, by the measured growth, if distances stay as they
    /// are at least.
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
                let translation = match (mobility, forced) {
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

/// Whether the rotation is that of the step as a whole where no moment acts.
fn turns_once(method: Method) -> bool {
    matches!(
        method,
        Method::Composition {
            rotor: Rotor::Exact,
            ..
        } | Method::Nystrom { .. }
    )
}
