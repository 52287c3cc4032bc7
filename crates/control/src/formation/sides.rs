//! Initial guesses on the sides of another body, on which a body may pass it.

use lgvi_dynamics::BodyState;
use nalgebra::Vector3;

use super::separation::{Approach, Path};
use crate::{Plan, Transfer};

/// Distance at which a guess passes, in parts of the separation.
const CLEAR: f64 = 1.2;
/// Distance, in parts of the separation, below which two paths meet.
const MEETING: f64 = 1e-3;

/// The guesses of a body that comes too near to another one: past it on four sides, perpendicular to the relative velocity where
/// they are nearest.
pub(super) fn guesses(
    transfer: &Transfer,
    plan: &Plan,
    other: &Path,
    approach: Approach,
    separation: f64,
) -> Vec<Plan> {
    let intervals = plan.commands.len();
    let at = |end: usize| plan.states[end].position - other.ends[end];
    let end = match at(approach.step).norm() <= at(approach.step + 1).norm() {
        true => approach.step,
        false => approach.step + 1,
    };
    let end = end.clamp(1, intervals - 1);
    let velocity = at(end + 1) - at(end - 1);
    let along = velocity.try_normalize(0.0).unwrap_or(Vector3::x());
    let away = at(end) - along.dot(&at(end)) * along;
    let distance = away.norm();
    let first = match distance > MEETING * separation {
        true => away / distance,
        false => {
            let least = along.iamin();
            along.cross(&Vector3::ith(least, 1.0)).normalize()
        }
    };
    let second = along.cross(&first);
    let clear = CLEAR * separation;
    let aside = (clear * clear - distance * distance).max(0.0).sqrt();
    let shifts = [
        (clear - distance) * first,
        aside * second,
        -aside * second,
        -(clear + distance) * first,
    ];
    let shifted = shifts.map(|shift| shifted(transfer, plan, end, shift));
    shifted.into()
}

/// The plan with its path shifted, most at one end of a step and not at all at its own ends, without multipliers.
fn shifted(transfer: &Transfer, plan: &Plan, most: usize, shift: Vector3<f64>) -> Plan {
    let intervals = plan.commands.len();
    let bump = |end: f64| {
        let part = match end <= most as f64 {
            true => end / most as f64,
            false => (intervals as f64 - end) / (intervals - most) as f64,
        };
        part * part * (3.0 - 2.0 * part)
    };
    let momentum = transfer.body.mass() / plan.h;
    let moved = |(end, state): (usize, &BodyState)| {
        let end = end as f64;
        let around = bump((end + 0.5).min(intervals as f64)) - bump((end - 0.5).max(0.0));
        BodyState {
            position: state.position + bump(end) * shift,
            linear_momentum: state.linear_momentum + momentum * around * shift,
            ..*state
        }
    };
    Plan {
        states: plan.states.iter().enumerate().map(moved).collect(),
        multipliers: Vec::new(),
        ..plan.clone()
    }
}
