//! What a plan keeps of its last model.

use std::any::Any;
use std::sync::Arc;

use nalgebra::SVector;

use crate::newton::Policies;
use crate::units::Units;
use crate::{Actuation, Comparable, Dynamics, Motion, Terminal, Transfer};

/// The solver's own data of a plan: how commands and multipliers answer to a change of the state.
///
/// A warm start from the plan reuses it instead of solving the linear-quadratic problem anew. The default contains
/// nothing.
#[derive(Clone, Default, PartialEq)]
pub struct Sweep {
    found: Option<Found>,
}

#[derive(Clone)]
struct Found {
    problem: Similar,
    /// The units of the numbers here.
    units: Units,
    /// [`Policies`] of the plan's class of motion.
    policies: Arc<dyn Comparable + Send + Sync>,
    /// Stages of the policies before the plan begins.
    flown: usize,
    /// The terminal multipliers, by rows of the class.
    nu: SVector<f64, 12>,
    /// How far the plan may be from the one that the policies were computed for.
    strayed: f64,
}

/// What two transfers have in common if one is the rest of the other from another state.
#[derive(Clone, PartialEq)]
struct Similar {
    h: f64,
    dynamics: Dynamics,
    motion: Motion,
    actuation: Actuation,
    target: Terminal,
}

impl PartialEq for Found {
    fn eq(&self, other: &Self) -> bool {
        let rest = |it: &Self| (it.units, it.flown, it.nu, it.strayed);
        self.problem == other.problem
            && rest(self) == rest(other)
            && self.policies.equals(&*other.policies as &dyn Any)
    }
}

impl Similar {
    fn of(transfer: &Transfer) -> Self {
        Self {
            h: transfer.h,
            dynamics: transfer.dynamics,
            motion: transfer.motion,
            actuation: transfer.actuation.clone(),
            target: transfer.target.clone(),
        }
    }
}

impl Sweep {
    /// The policies of a plan of `transfer`, at a distance of `strayed` from it.
    pub(crate) fn new<const X: usize, const U: usize>(
        transfer: &Transfer,
        policies: Policies<X, U>,
        nu: &SVector<f64, X>,
        strayed: f64,
    ) -> Self {
        let found = Found {
            problem: Similar::of(transfer),
            units: Units::ones(),
            policies: Arc::new(policies),
            flown: 0,
            nu: wide(nu),
            strayed,
        };
        Self { found: Some(found) }
    }

    /// The policies and the multipliers from which `transfer` can be planned, or `None` if it is not the rest of the
    /// plan's transfer from a nearby state.
    pub(crate) fn of<const X: usize, const U: usize>(
        &self,
        transfer: &Transfer,
    ) -> Option<(Policies<X, U>, SVector<f64, X>)> {
        let found = self.found.as_ref()?;
        let policies = &*found.policies as &dyn Any;
        let all = policies.downcast_ref::<Policies<X, U>>()?;
        let fits = all.stages.len() == found.flown + transfer.intervals
            && found.problem == Similar::of(transfer);
        let rest = fits.then(|| all.rest(found.flown))??;
        Some((rest, found.nu.fixed_rows::<X>(0).into_owned()))
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

    /// How far the plan may be from the one that its policies were computed for.
    pub(crate) fn strayed(&self) -> f64 {
        self.found
            .as_ref()
            .map_or(f64::INFINITY, |found| found.strayed)
    }

    /// The sweep of the rest of the plan after `step` steps.
    pub(crate) fn remaining(&self, step: usize) -> Self {
        let mut rest = self.clone();
        if let Some(found) = &mut rest.found {
            found.flown += step;
        }
        rest
    }

    /// The sweep of a plan that has left `units`.
    pub(crate) fn left(&mut self, units: &Units) {
        if let Some(found) = &mut self.found {
            found.units = *units;
        }
    }

    /// The sweep of a plan that enters `units`. Nothing is left of it if its numbers are in other units.
    pub(crate) fn entered(&mut self, units: &Units) {
        self.found.take_if(|found| found.units != *units);
        self.left(&Units::ones());
    }
}

/// `X` rows among twelve; the others are zero.
fn wide<const X: usize>(rows: &SVector<f64, X>) -> SVector<f64, 12> {
    let mut all = SVector::<f64, 12>::zeros();
    all.fixed_rows_mut::<X>(0).copy_from(rows);
    all
}
