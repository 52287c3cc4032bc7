//! Plans by thrusters, or by an engine, that use propellant.
//!
//! With the momenta in proportion to the mass, `γ̃ = γ M/m` and `Π̃ = Π M/m`, and the commands `w = F M/m`, where M is the mass
//! with all propellant and m of the commands that in the middle of a step, a step of the body that loses mass is one of the
//! constant mass M, because inertia and gravity are in proportion to the mass. The mass remains in the limits, `F ≤ F_max`, in
//! the drag, which is M/m times that of the body, in the cost of the mass that is used, which loosens later limits and slows the
//! body down more, and in the Coriolis force and the jet damping of gas that leaves a body that turns. These are taken from a
//! plan and the transfer is solved again, until they are those of its own plan.

mod along;
mod ejection;
mod flight;
mod flows;
mod masses;
mod scaled;

use crate::anderson::{Anderson, minus};
use crate::multistart::{resolved, search_stated};
use crate::solver::{Consecutive, NewtonSettings, PlanError, Progress, Start, solve_stated};
use crate::{Minimum, Motion, Plan, SearchSettings, Transfer, TransferError};
use flight::fly;
use masses::Masses;
use scaled::Scaled;

/// Relative change of the limits, and of the costs relative to the largest force of a condition, up to which they have settled.
const SETTLED: [f64; 2] = [1e-8, 1e-6];
/// Distance of the ends of a plan and of its flight, relative to the size of each quantity, up to which they are the same.
const SAME: f64 = 1e-8;
/// The part of the way to the result of an iteration that is gone, and the number of earlier iterations that count.
const DAMPING: f64 = 0.8;
const MEMORY: usize = 5;
/// The factor of the tolerance of the stationarity once the costs have settled. Where drag lets an engine burn below its limit,
/// the masses depend on the stationarity more than elsewhere.
const PRECISE: f64 = 1e-3;
/// The least tolerance that this factor leads to, above rounding.
const LEAST: f64 = 1e-12;
/// Largest number of times that the transfer is solved.
const MOST: usize = 60;

/// [`crate::solve`] for a transfer that uses propellant.
pub(crate) fn solve(
    transfer: &Transfer,
    start: Start<'_>,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    let scaled = Scaled::new(transfer)?;
    let mut progress = Consecutive::new(observe);
    let mut plan = match start {
        Start::Cold => None,
        Start::Warm(plan) => scaled.entered(plan),
    };
    let mut along = match &plan {
        Some(plan) if plan.commands.len() == transfer.intervals => scaled.along(plan).ok(),
        _ => None,
    }
    .unwrap_or_else(|| {
        plan = None;
        scaled.with_even_use(0.0)
    });
    let mut settling = Anderson::new(DAMPING, MEMORY);
    let mut lighter = plan.is_some();
    let mut violation = f64::INFINITY;
    let mut precise = *settings;
    let mut sharpens = transfer.body.drag().is_some();
    for _ in 0..MOST {
        let stated = scaled.stated(&along);
        let start = plan.as_ref().map_or(Start::Cold, Start::Warm);
        let found = match solve_stated(&stated, start, &precise, progress.next()) {
            Ok(found) => found,
            Err(error) if !lighter && error.is_missing() => {
                along = scaled.with_even_use(1.0);
                settling = Anderson::new(DAMPING, MEMORY);
                (plan, lighter) = (None, true);
                continue;
            }
            Err(error) if precise != *settings && error.is_missing() => {
                (precise, sharpens) = (*settings, false);
                continue;
            }
            Err(error) => return Err(scaled.left_error(error)),
        };
        let next = scaled.along(&found)?;
        let changes = along.changes(&next);
        violation = changes[0].max(changes[1]);
        if changes[1] <= SETTLED[1] && sharpens {
            precise.stationarity = (PRECISE * settings.stationarity)
                .max(LEAST)
                .min(settings.stationarity);
        }
        if changes[0] <= SETTLED[0] && changes[1] <= SETTLED[1] {
            scaled.check_propellant(&found)?;
            let states = fly(transfer, &scaled.forces(&found.commands))?;
            let apart = scaled.distance(&stated, &found, &states);
            if apart <= SAME.max(2.0 * found.certificate.terminal) {
                return Ok(scaled.left(found, Some(states), apart));
            }
            violation = apart;
        }
        let [x, result] = [along.vector(next.size), next.vector(next.size)];
        let x = settling.next(&x, &minus(&result, &x));
        along = next.at(&x);
        plan = Some(found);
    }
    let last = plan.map(|found| scaled.left(found, None, violation));
    Err(PlanError::NotConverged {
        stationarity: last
            .as_ref()
            .map_or(f64::INFINITY, |plan| plan.certificate.stationarity),
        best: last.map(Box::new),
        iterations: progress.made()[0],
        violation,
        tolerance: SAME,
    })
}

/// [`crate::search`] for a transfer that uses propellant, among the minima of a body that does not lose mass.
pub(crate) fn search(
    transfer: &Transfer,
    settings: &SearchSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Vec<Minimum>, PlanError> {
    let scaled = Scaled::new(transfer)?;
    let stated = scaled.stated(&scaled.with_even_use(0.0));
    let mut progress = Consecutive::new(observe);
    let minima = search_stated(&stated, settings, progress.next())
        .map_err(|error| scaled.left_error(error))?;
    resolved(minima, |plan| {
        let guess = scaled.left(plan, None, 0.0);
        let start = Start::Warm(&guess);
        solve(transfer, start, &settings.newton, &mut progress.next())
    })
}

impl Transfer {
    /// Whether the commands use propellant.
    pub(crate) fn uses_propellant(&self) -> bool {
        let Some(all) = self.body.thrusters() else {
            return false;
        };
        let mut thrusters = all.thrusters().iter();
        if self.actuation.is_fixed_to_body() {
            return thrusters.any(|one| one.exhaust_velocity.is_finite());
        }
        all.engine().is_some() && self.motion != Motion::Rotation && self.actuation.is_of_loads()
    }

    /// The transfer of a body that has so much propellant left at its start. The momenta of the target remain those of the body
    /// with all its propellant.
    ///
    /// # Errors
    /// Returns an error if there is more than the body can have, or if it is not a number ≥ 0.
    pub fn with_propellant(mut self, left: f64) -> Result<Self, TransferError> {
        let thrusters = self.body.thrusters();
        let most = thrusters.map_or(0.0, |thrusters| thrusters.propellant().mass);
        if !(0.0..=most).contains(&left) {
            return Err(TransferError::Propellant { left, most });
        }
        self.body.set_propellant(left);
        Ok(self)
    }
}

impl Plan {
    /// The masses of the body of `transfer`, by which it was planned, at `0 … N`.
    pub fn masses(&self, transfer: &Transfer) -> Vec<f64> {
        if transfer.uses_propellant() {
            Masses::under(transfer, &self.commands).ends
        } else {
            vec![transfer.body.mass(); self.states.len()]
        }
    }
}
