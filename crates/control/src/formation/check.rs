use super::error::FormationError;
use crate::{Motion, Plan, Transfer};

/// By how much, in parts of the separation, bodies may be nearer to each other at the start or the end: so much a plan may be off.
const NEARER: f64 = 1e-6;

/// Checks that transfers can be planned together: that there are two or more with the same steps, that each moves its body at a
/// quadratic cost, and that all keep apart at their starts and, where the targets fix them, at their ends.
///
/// # Errors
/// Returns an error that says what does not fit.
pub fn check_together(transfers: &[Transfer], separation: f64) -> Result<(), FormationError> {
    if transfers.len() < 2 {
        return Err(FormationError::Few(transfers.len()));
    }
    if !(separation > 0.0 && separation.is_finite()) {
        return Err(FormationError::Separation(separation));
    }
    let unsupported = |body, what, expected| {
        Err(FormationError::Unsupported {
            body,
            what,
            expected,
        })
    };
    for (body, transfer) in transfers.iter().enumerate() {
        if transfer.h != transfers[0].h || transfer.intervals != transfers[0].intervals {
            return Err(FormationError::Steps {
                body,
                intervals: transfer.intervals,
                h: transfer.h,
            });
        }
        if transfer.motion == Motion::Rotation {
            return unsupported(body, "a plan of its attitude alone", "one of its position");
        }
        if transfer.chances.is_some() {
            let expected = "constraints on the nominal flight";
            return unsupported(body, "constraints that hold with a probability", expected);
        }
        if transfer.uses_propellant() {
            let expected = "a constant mass";
            return unsupported(body, "commands that use propellant", expected);
        }
        if transfer.actuation.minimizes_fuel() {
            return unsupported(body, "a cost of fuel", "a quadratic cost");
        }
    }
    let ends = |transfer: &Transfer| {
        let mut end = transfer.initial;
        transfer.terminal.aim(&mut end);
        let fixed = transfer.terminal.translation.fixes_pose();
        fixed.then_some(end.position)
    };
    for body in 0..transfers.len() {
        for other in 0..body {
            let two = [&transfers[other], &transfers[body]];
            let start = two.map(|transfer| Some(transfer.initial.position));
            for (at, two) in [("start", start), ("end", two.map(ends))] {
                let [Some(one), Some(two)] = two else {
                    continue;
                };
                let distance = (one - two).norm();
                if distance < separation * (1.0 - NEARER) {
                    return Err(FormationError::Near {
                        bodies: [other, body],
                        at,
                        distance,
                        separation,
                    });
                }
            }
        }
    }
    Ok(())
}

/// Checks that plans to start from, if there are any, are those of the transfers.
pub(super) fn check_warm(transfers: &[Transfer], warm: &[Plan]) -> Result<(), FormationError> {
    let (count, intervals) = (transfers.len(), transfers[0].intervals);
    let fits = |plan: &Plan| plan.commands.len() == intervals;
    if warm.is_empty() || warm.len() == count && warm.iter().all(fits) {
        return Ok(());
    }
    Err(FormationError::Warm {
        steps: warm.iter().map(|plan| plan.commands.len()).collect(),
        transfers: count,
        intervals,
    })
}
