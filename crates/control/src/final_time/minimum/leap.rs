use super::{Fastest, FinalTimeError, Timed};
use crate::final_time::is_missing;
use crate::final_time::slope::is_whole;
use crate::solver::{PlanError, Progress, TimePrice, TimedPath, with_free_time};
use crate::{Motion, Plan, Transfer};

/// What a leap finds.
#[derive(Default)]
pub(super) struct Leap {
    /// A lower bound of the shortest final time, or 0.
    pub(super) bound: f64,
    /// A plan near it, and its final time.
    pub(super) found: Option<(f64, Plan)>,
    /// Number of transfers solved.
    pub(super) solves: u32,
}

/// The price of time, in parts of the greatest cost of commands per unit of time and of the tolerance.
const PRICE: f64 = 2.0;
/// What the barrier costs at the end, in parts of the tolerance.
const GAP: f64 = 0.01;
/// By how much the final time is longer at which a plan of least cost is planned, in parts of the tolerance.
const LONGER: [f64; 3] = [0.4, 3.0, 30.0];

impl Fastest<'_> {
    /// Minimizes `J + price · T` from a plan with the final time among the unknowns, and plans in a slightly longer time.
    ///
    /// Plans cost at most `rate · T`, so that the minimum is at most `(rate + price) T*`. The price is so high that it tells `T*` to half
    /// the tolerance.
    pub(super) fn leap(
        &self,
        from: &Timed,
        observe: &mut dyn FnMut(&Progress) -> bool,
    ) -> Result<Leap, FinalTimeError> {
        let tolerance = self.range.tolerance;
        let price = TimePrice {
            rate: PRICE * self.rate / tolerance,
            gap: GAP * tolerance,
        };
        let mut leap = Leap {
            solves: 1,
            ..Leap::default()
        };
        let transfer = self.at(from.final_time);
        let least = with_free_time(&transfer, &from.plan, &price, self.settings, &mut *observe);
        let TimedPath { plan: path, bound } = match least {
            Ok(least) => least,
            Err(error @ PlanError::Stopped { .. }) => {
                return Err(from.failed(from.final_time, error));
            }
            Err(_) => return Ok(leap),
        };
        let known = from.plan.cost + price.rate * from.final_time;
        if bound.is_some_and(|bound| bound > known) {
            // The path is not of this family.
            return Ok(leap);
        }
        let bound = bound.filter(|_| keeps_its_problem(&transfer, &from.plan));
        let bound = bound.unwrap_or(0.0) / (price.rate + self.rate);
        let shortest = path.h * transfer.intervals as f64;
        let mut last = 0.0;
        for longer in LONGER {
            let final_time = (shortest * (1.0 + longer * tolerance)).max(self.range.shortest);
            if final_time >= from.final_time || final_time == last {
                break;
            }
            last = final_time;
            leap.solves += 1;
            match self.near(&self.at(final_time), &path, observe) {
                Ok(plan) => {
                    leap.found = Some((final_time, plan));
                    break;
                }
                Err(error) if is_missing(&error) => (),
                Err(error) => return Err(from.failed(final_time, error)),
            }
        }
        let closes = (from.final_time - bound) <= tolerance * from.final_time;
        if leap.found.is_some() || closes {
            leap.bound = bound;
        }
        Ok(leap)
    }
}

/// True if the path is that of the transfer at any final time: what moves would be elsewhere at another one.
fn keeps_its_problem(transfer: &Transfer, plan: &Plan) -> bool {
    let mut rows = transfer.inequalities.state.iter();
    if rows.any(|row| !row.through(transfer.h, transfer.intervals).is_empty()) {
        return false;
    }
    if transfer.actuation.is_of_wheels() {
        // The orbit is that of the plan.
        let (body, field) = (&transfer.body, &transfer.field);
        return plan.states.iter().all(|state| {
            let load = field.load(body, &state.position, &state.attitude);
            load.moment.norm() == 0.0
        });
    }
    transfer.motion == Motion::Full || !is_whole(transfer.motion, plan)
}
