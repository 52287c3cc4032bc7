use super::{Fastest, FinalTimeError, Timed};
use crate::Plan;
use crate::final_time::is_missing;
use crate::solver::{Progress, TimePrice, with_free_time};

/// What a leap finds.
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
    /// The price is so high that the minimum of `J + price · T`, which is at most `(rate + price) T*`, tells `T*` to half the tolerance.
    /// Returns `None` if no minimum is found, or that of another family.
    pub(super) fn leap(
        &self,
        from: &Timed,
        observe: &mut dyn FnMut(&Progress) -> bool,
    ) -> Result<Option<Leap>, FinalTimeError> {
        let tolerance = self.range.tolerance;
        let price = TimePrice {
            rate: PRICE * self.rate / tolerance,
            gap: GAP * tolerance,
        };
        let transfer = self.at(from.final_time);
        let least = with_free_time(&transfer, &from.plan, &price, self.settings, &mut *observe);
        let least = match least {
            Ok(least) => least,
            Err(error) if is_missing(&error) => return Ok(None),
            Err(error) => return Err(from.failed(from.final_time, error)),
        };
        let bound = least.bound.unwrap_or(0.0) / (price.rate + self.rate);
        if bound > from.final_time {
            return Ok(None);
        }
        let shortest = least.plan.h * self.transfer.intervals as f64;
        let mut leap = Leap {
            bound,
            found: None,
            solves: 1,
        };
        for longer in LONGER {
            let final_time = (shortest * (1.0 + longer * tolerance)).max(self.range.shortest);
            if final_time >= from.final_time {
                break;
            }
            leap.solves += 1;
            match self.near(&self.at(final_time), &least.plan, observe) {
                Ok(plan) => {
                    leap.found = Some((final_time, plan));
                    break;
                }
                Err(error) if is_missing(&error) => (),
                Err(error) => return Err(from.failed(final_time, error)),
            }
        }
        Ok(Some(leap))
    }
}
