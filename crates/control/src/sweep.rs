//! What a plan keeps of its last model.

use std::any::Any;
use std::sync::Arc;

use nalgebra::SVector;

use crate::newton::Policies;
use crate::problem::{Effects, Off, Weight};
use crate::units::Units;
use crate::{Comparable, Dynamics, Motion, Terminal, Transfer};

/// The solver's own data of a plan: how commands and multipliers answer to a change of the state.
///
/// A warm start from the plan reuses it instead of solving the linear-quadratic problem anew. The default contains
/// nothing.
#[derive(Clone, Default, PartialEq)]
pub struct Sweep {
    found: Option<Found>,
    /// The multipliers of each inequality on states at the ends of the steps.
    multipliers: Vec<Vec<f64>>,
    /// `Σ y ∂g/∂h` of inequalities that depend on the step size.
    by_step_size: f64,
}

#[derive(Clone)]
struct Found {
    problem: Similar,
    /// The units of the policies.
    units: Units,
    /// [`Policies`] of the plan's class of motion.
    policies: Arc<dyn Comparable + Send + Sync>,
    /// Stages of the policies before the plan begins.
    flown: usize,
    /// The terminal multipliers by rows of the class, in the units in which the transfer is stated.
    nu: SVector<f64, 12>,
    /// How far the plan may be from the one that the policies were computed for.
    strayed: f64,
    /// The commands that are off in the steps of the policies; empty if none ever is.
    off: Vec<Off>,
}

/// What two transfers have in common if one is the rest of the other from another state, in the units in which they are
/// stated.
#[derive(Clone, PartialEq)]
struct Similar {
    h: f64,
    dynamics: Dynamics,
    motion: Motion,
    target: Terminal,
    /// `B`, without columns beyond the last command.
    effects: Effects,
    /// `W`, without commands beyond the last one.
    weight: Weight,
    fixed_to_body: bool,
}

/// Policies that lead to a plan of a transfer.
pub(crate) struct Known<const X: usize, const U: usize> {
    pub(crate) policies: Policies<X, U>,
    /// The units of the policies.
    pub(crate) units: Units,
    /// The terminal multipliers of the plan, in the units in which the transfer is stated.
    pub(crate) nu: SVector<f64, X>,
    /// How far the plan may be from the one that the policies were computed for.
    pub(crate) strayed: f64,
    /// The part of that plan's stages that has been flown.
    pub(crate) flown: f64,
}

impl PartialEq for Found {
    fn eq(&self, other: &Self) -> bool {
        let rest = |it: &Self| (it.units, it.flown, it.nu, it.strayed);
        self.problem == other.problem
            && rest(self) == rest(other)
            && self.off == other.off
            && self.policies.equals(&*other.policies as &dyn Any)
    }
}

impl Found {
    /// Whether the same commands are off in the steps that are left as in those of `transfer`.
    fn has_off(&self, transfer: &Transfer) -> bool {
        let rest = self.off.get(self.flown..).unwrap_or_default();
        let none = transfer.off.is_none() && rest.iter().all(|off| off.is_none());
        none || rest == transfer.off_by_step(Some)
    }
}

impl Similar {
    /// Of a transfer in its own units.
    fn of(transfer: &Transfer) -> Self {
        let units = transfer.terminal.units();
        let (loads, commands) = (units.loads(), units.commands());
        let actuation = &transfer.actuation;
        let used = |command: usize| command < actuation.commands();
        let rate = units.cost() / units.time();
        let effect =
            |load, command| actuation.matrix()[(load, command)] * (loads[load] / commands[command]);
        let weight = |i, j| actuation.weight()[(i, j)] * (rate / (commands[i] * commands[j]));
        let chosen = |chosen: bool, entry: f64| if chosen { entry } else { 0.0 };
        Self {
            h: transfer.h * units.time(),
            dynamics: transfer.dynamics,
            motion: transfer.motion,
            target: transfer.target.clone(),
            fixed_to_body: actuation.is_fixed_to_body(),
            effects: Effects::from_fn(|i, j| chosen(used(j), effect(i, j))),
            weight: Weight::from_fn(|i, j| chosen(used(i) && used(j), weight(i, j))),
        }
    }
}

impl Sweep {
    /// The policies of a plan of `transfer`, which is in its own units, at a distance of `strayed` from it.
    pub(crate) fn new<const X: usize, const U: usize>(
        transfer: &Transfer,
        policies: Policies<X, U>,
        nu: &SVector<f64, X>,
        strayed: f64,
    ) -> Self {
        let found = Found {
            problem: Similar::of(transfer),
            units: *transfer.terminal.units(),
            policies: Arc::new(policies),
            flown: 0,
            nu: wide(nu),
            strayed,
            off: transfer.off_by_step(Some),
        };
        Self {
            found: Some(found),
            ..Self::default()
        }
    }

    /// The multipliers of a plan under inequalities, which has no policies, and `Σ y ∂g/∂h`.
    pub(crate) fn of_inequalities(multipliers: Vec<Vec<f64>>, by_step_size: f64) -> Self {
        Self {
            found: None,
            multipliers,
            by_step_size,
        }
    }

    /// The sweep without policies.
    pub(crate) fn without_policies(self) -> Self {
        Self {
            found: None,
            ..self
        }
    }

    /// The sweep with what depends on the step size alone.
    pub(crate) fn without_states(self) -> Self {
        Self::of_inequalities(Vec::new(), self.by_step_size)
    }

    /// `Σ y ∂g/∂h` of inequalities that depend on the step size.
    pub(crate) fn by_step_size(&self) -> f64 {
        self.by_step_size
    }

    /// The multipliers of each inequality on states at the ends of the steps.
    pub(crate) fn multipliers(&self) -> &[Vec<f64>] {
        &self.multipliers
    }

    /// Converts the multipliers to other units of cost and time.
    pub(crate) fn scale(&mut self, cost: f64, time: f64) {
        let all = self.multipliers.iter_mut().flatten();
        all.for_each(|multiplier| *multiplier *= cost);
        self.by_step_size *= cost / time;
    }

    /// The policies from which `transfer` can be planned, or `None` if it is not the rest of the plan's transfer from
    /// another state.
    pub(crate) fn of<const X: usize, const U: usize>(
        &self,
        transfer: &Transfer,
    ) -> Option<Known<X, U>> {
        let found = self.found.as_ref()?;
        let policies = &*found.policies as &dyn Any;
        let all = policies.downcast_ref::<Policies<X, U>>()?;
        let fits = all.stages.len() == found.flown + transfer.intervals
            && found.problem == Similar::of(transfer)
            && found.has_off(transfer);
        fits.then(|| Known {
            policies: all.rest(found.flown),
            units: found.units,
            nu: found.nu.fixed_rows::<X>(0).into_owned(),
            strayed: found.strayed,
            flown: found.flown as f64 / all.stages.len() as f64,
        })
    }

    /// The same policies for a plan that differs by `apart` and has the terminal multipliers `nu`.
    pub(crate) fn moved<const X: usize>(&self, apart: f64, nu: &SVector<f64, X>) -> Self {
        let mut moved = self.clone();
        if let Some(found) = &mut moved.found {
            found.nu = wide(nu);
            found.strayed += apart;
        }
        moved
    }

    /// The sweep of the rest of the plan after `step` steps.
    pub(crate) fn remaining(&self, step: usize) -> Self {
        let mut rest = self.clone();
        if let Some(found) = &mut rest.found {
            found.flown += step;
        }
        for row in &mut rest.multipliers {
            row.drain(..step.min(row.len()));
        }
        rest
    }
}

/// `X` rows among twelve; the others are zero.
fn wide<const X: usize>(rows: &SVector<f64, X>) -> SVector<f64, 12> {
    let mut all = SVector::<f64, 12>::zeros();
    all.fixed_rows_mut::<X>(0).copy_from(rows);
    all
}
