//! Plans whose phases begin at other steps.

use lgvi_dynamics::{BodyState, Load};
use lgvi_lie::{exp, log};

use crate::{Certificate, Plan, Sweep};

/// A map of the steps `0 … N` onto themselves, linear between the steps at which phases begin.
struct Schedule {
    from: Vec<usize>,
    to: Vec<usize>,
}

impl Schedule {
    fn new(from: &[usize], to: &[usize], intervals: usize) -> Option<Self> {
        let bounded = |switches: &[usize]| {
            let inner = switches.iter().copied();
            let all: Vec<_> = std::iter::once(0).chain(inner).chain([intervals]).collect();
            all.is_sorted_by(|a, b| a < b).then_some(all)
        };
        let (from, to) = (bounded(from)?, bounded(to)?);
        (from.len() == to.len()).then_some(Self { from, to })
    }

    /// The time in the old schedule, in steps, that corresponds to `step` in the new one, and by how much faster it passes.
    fn before(&self, step: f64) -> (f64, f64) {
        let inner = &self.to[1..self.to.len() - 1];
        let phase = inner.partition_point(|&begin| begin as f64 <= step);
        let [from, to] = [&self.from, &self.to].map(|all| [all[phase], all[phase + 1]]);
        let rate = (from[1] - from[0]) as f64 / (to[1] - to[0]) as f64;
        (from[0] as f64 + rate * (step - to[0] as f64), rate)
    }
}

impl Plan {
    /// A guess for a transfer whose phases begin at the steps `to` instead of `from`: the path of this plan, with each phase stretched
    /// or shortened. It has no multipliers, so that a solver takes it as a path, and its certificate is the default one.
    ///
    /// Returns `None` unless both are equally many steps between 0 and N, in increasing order, and the plan has all its states.
    pub fn rescheduled(&self, from: &[usize], to: &[usize]) -> Option<Self> {
        let intervals = self.commands.len();
        if self.states.len() != intervals + 1 || self.controls.len() != intervals {
            return None;
        }
        let schedule = Schedule::new(from, to, intervals)?;
        let split = |time: f64| {
            let step = (time as usize).min(intervals - 1);
            (step, time - step as f64)
        };
        let state = |step: usize| {
            let (time, rate) = schedule.before(step as f64);
            let (step, part) = split(time);
            let state = between(&self.states[step], &self.states[step + 1], part);
            BodyState {
                linear_momentum: rate * state.linear_momentum,
                angular_momentum: rate * state.angular_momentum,
                ..state
            }
        };
        let same = |step: usize| {
            let (time, rate) = schedule.before(step as f64 + 0.5);
            (split(time).0, rate * rate)
        };
        let command = |step: usize| {
            let (step, factor) = same(step);
            factor * self.commands[step]
        };
        let control = |step: usize| {
            let (step, factor) = same(step);
            let Load { force, moment } = self.controls[step];
            Load {
                force: factor * force,
                moment: factor * moment,
            }
        };
        Some(Self {
            h: self.h,
            states: (0..=intervals).map(state).collect(),
            commands: (0..intervals).map(command).collect(),
            controls: (0..intervals).map(control).collect(),
            multipliers: Vec::new(),
            feedback: Vec::new(),
            actuator_feedback: Vec::new(),
            cost: self.cost,
            paid: self.paid,
            certificate: Certificate::default(),
            sweep: Sweep::default(),
        })
    }
}

/// The state at this part of the way, along the geodesic of the attitude.
fn between(one: &BodyState, other: &BodyState, part: f64) -> BodyState {
    let turn = log(&one.attitude.tr_mul(&other.attitude));
    BodyState {
        position: one.position.lerp(&other.position, part),
        linear_momentum: one.linear_momentum.lerp(&other.linear_momentum, part),
        attitude: one.attitude * exp(&(part * turn)),
        angular_momentum: one.angular_momentum.lerp(&other.angular_momentum, part),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_belongs_to_the_same_part_of_the_same_phase() {
        let schedule = Schedule::new(&[20, 30], &[10, 30], 50).unwrap();
        let steps = [0.0, 5.0, 9.5, 10.0, 20.0, 30.0, 41.5, 50.0];
        let before = [0.0, 10.0, 19.0, 20.0, 25.0, 30.0, 41.5, 50.0];
        assert_eq!(steps.map(|step| schedule.before(step).0), before);
        let rates = [2.0, 2.0, 2.0, 0.5, 0.5, 1.0, 1.0, 1.0];
        assert_eq!(steps.map(|step| schedule.before(step).1), rates);
    }

    #[test]
    fn schedules_that_are_no_schedules_are_refused() {
        for (from, to) in [
            (&[20, 30][..], &[10][..]),
            (&[20, 30], &[30, 20]),
            (&[20, 30], &[20, 20]),
            (&[0, 30], &[20, 30]),
            (&[20, 30], &[20, 50]),
        ] {
            assert!(Schedule::new(from, to, 50).is_none(), "{from:?} {to:?}");
        }
    }
}
