use super::{Fastest, FinalTimeError, MinimumTime, TimeRange, Timed, failed};
use crate::final_time::{is_missing, retimed};
use crate::solver::{NewtonSettings, PlanError, Progress, Start, Warmth, solve_near};
use crate::{Minimum, SearchSettings, Transfer, search};

/// Parts of the best final time that the next search is to save, in the order of trial. Nearer to the shortest final time,
/// fewer local minima remain, and more starts lead to the shortest family.
const SAVED: [f64; 3] = [0.02, 0.05, 0.1];

/// Parts of the distance between the best final time and its lower bound that the next search is to save, if the distance
/// is greater than this multiple of the tolerance.
const NEARER: [f64; 2] = [0.5, 0.2];
const APART: f64 = 10.0;

/// Relative difference within which plans that mirror each other cost the same.
const SAME: f64 = 1e-6;

/// Parts by which the final time is longer where a plan is refined.
const LONGER: [f64; 4] = [0.01, 0.03, 0.1, 0.3];

/// [`super::solve_minimum_time`] for several families of plans: that of the cold start, and those of a search for local
/// minima at shorter final times, again and again until it finds none: 2, 5 and 10 % below the best one, and between it
/// and its lower bound.
///
/// The families are followed at the solver's coarse resolution, and the best plan is refined to all intervals. Without a
/// plan from the cold start, the search begins at the longest final time.
///
/// # Assumptions and limitations
/// The search is not exhaustive.
///
/// # Errors
/// Returns the errors of [`super::solve_minimum_time`].
pub fn search_minimum_time(
    transfer: &Transfer,
    range: &TimeRange,
    settings: &SearchSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<MinimumTime, FinalTimeError> {
    let newton = &settings.newton;
    let fastest = Fastest::new(transfer, range, newton)?;
    let intervals = transfer.intervals.min(newton.coarse.max(2));
    let coarse = Transfer {
        h: transfer.h * (transfer.intervals as f64 / intervals as f64),
        intervals,
        ..transfer.clone()
    };
    let coarse = Fastest {
        transfer: &coarse,
        ..fastest
    };
    let mut best = match coarse.first(Start::Cold, &mut observe) {
        Ok(first) => coarse.descend(first, &mut observe),
        Err(error) => Err(error),
    };
    loop {
        let final_times = match &best {
            Ok(best) => shorter_times(best, range),
            Err(error) if is_final(error) => break,
            Err(_) => vec![range.longest],
        };
        let mut shorter = None;
        for final_time in final_times {
            if shorter.is_none() && final_time >= range.shortest {
                shorter = shortest_family(&coarse, final_time, settings, &mut observe)?;
            }
        }
        match shorter {
            Some(found) => best = Ok(found),
            None => break,
        }
    }
    let best = best?;
    if intervals == transfer.intervals {
        return Ok(best);
    }
    refined(&fastest, &best, newton, &mut observe)
}

/// The final times below the best one at which to search.
fn shorter_times(best: &MinimumTime, range: &TimeRange) -> Vec<f64> {
    let time = best.final_time;
    let gap = time - best.lower_bound;
    let mut times = SAVED.map(|part| time - part * time).to_vec();
    if gap > APART * range.tolerance * time {
        times.extend(NEARER.map(|part| time - part * gap));
    }
    times
}

/// The shortest of the families that a search finds at a final time, if any.
fn shortest_family(
    fastest: &Fastest<'_>,
    final_time: f64,
    settings: &SearchSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Option<MinimumTime>, FinalTimeError> {
    let minima = match search(&fastest.at(final_time), settings, &mut *observe) {
        Ok(minima) => minima,
        Err(error) if is_missing(&error) => return Ok(None),
        Err(error) => return Err(failed(final_time, error)),
    };
    let mut best: Option<MinimumTime> = None;
    let mut known = f64::NAN;
    for Minimum { plan, .. } in minima {
        // The cheapest come first.
        if (plan.cost - known).abs() <= SAME * plan.cost {
            continue;
        }
        known = plan.cost;
        let first = Timed {
            final_time,
            plan,
            solves: 1,
        };
        best = shorter(best, fastest.descend(first, &mut *observe))?;
    }
    Ok(best)
}

/// The shorter of the best family and another one; a family that fails is skipped.
fn shorter(
    best: Option<MinimumTime>,
    found: Result<MinimumTime, FinalTimeError>,
) -> Result<Option<MinimumTime>, FinalTimeError> {
    let found = match found {
        Ok(found) => found,
        Err(error) if is_final(&error) => return Err(error),
        Err(_) => return Ok(best),
    };
    Ok(match best {
        Some(best) if best.final_time <= found.final_time => Some(best),
        _ => Some(found),
    })
}

/// True if no other family is to be tried.
fn is_final(error: &FinalTimeError) -> bool {
    match error {
        FinalTimeError::Plan { source, .. } => !is_missing(source),
        FinalTimeError::Unreached { .. }
        | FinalTimeError::NotConverged { .. }
        | FinalTimeError::Slope(_) => false,
        _ => true,
    }
}

/// The minimum in all intervals, from one in fewer.
fn refined(
    fastest: &Fastest<'_>,
    coarse: &MinimumTime,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<MinimumTime, FinalTimeError> {
    let mut failure = failed(coarse.final_time, PlanError::Stopped { best: None });
    for (part, solves) in LONGER.into_iter().zip(1..) {
        let final_time = (coarse.final_time * (1.0 + part)).min(fastest.range.longest);
        let path = retimed(&coarse.plan, final_time / coarse.plan.commands.len() as f64);
        let timed = fastest.at(final_time);
        match solve_near(&timed, &path, Warmth::ONCE, settings, &mut *observe) {
            Ok(plan) => {
                let first = Timed {
                    final_time,
                    plan,
                    solves,
                };
                match fastest.descend(first, &mut *observe) {
                    Err(error) if !is_final(&error) => failure = error,
                    done => return done,
                }
            }
            Err(error) if is_missing(&error) => failure = failed(final_time, error),
            Err(error) => return Err(failed(final_time, error)),
        }
    }
    Err(failure)
}

#[cfg(test)]
mod tests;
