use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector};

use super::penalty::Penalty;
use super::row::Row;
use super::violation::Violation;
use crate::newton::BySize;
use crate::problem::{InequalitySet, WheelSpeed};
use crate::riccati::StageModel;
use crate::{MAX_COMMANDS, Transfer};

/// Limits on the speeds of wheels, which depend on the state at the start of an interval and on its command.
#[derive(Clone, Debug)]
pub(super) struct WheelSpeeds<const X: usize, const U: usize> {
    initial: BodyState,
    h: f64,
    limits: Vec<Limit<X, U>>,
    /// A row for each interval and limit, unless the motor is off.
    rows: Vec<Option<Row>>,
    /// `∂g/∂h` of each row, once it is asked for.
    by_size: Vec<f64>,
    /// The change of the step size along the direction.
    change: f64,
}

/// `g = ±p/limit − 1`, linear.
#[derive(Clone, Debug)]
struct Limit<const X: usize, const U: usize> {
    index: usize,
    by_state: SVector<f64, X>,
    by_command: SVector<f64, U>,
    slack: f64,
}

impl<const X: usize, const U: usize> WheelSpeeds<X, U> {
    /// The limits of `set`, if it has any, under the commands that `selection` makes of the `U` planned ones.
    pub(super) fn new(
        transfer: &Transfer,
        set: &InequalitySet,
        selection: &SMatrix<f64, MAX_COMMANDS, U>,
    ) -> Option<Self> {
        if set.wheels.is_empty() {
            return None;
        }
        let sides = |wheel: &WheelSpeed| {
            let (by_state, by_command) = wheel.slopes(transfer.h);
            let by_command = selection.tr_mul(&by_command);
            [1.0, -1.0].map(|sign| Limit {
                index: wheel.index,
                by_state: by_state.fixed_rows::<X>(0) * sign,
                by_command: by_command * sign,
                slack: wheel.slack(),
            })
        };
        let limits: Vec<_> = set.wheels.iter().flat_map(sides).collect();
        let off = transfer.off_by_step(Some);
        let rows = (0..transfer.intervals).flat_map(|step| {
            let off = off.get(step).copied().unwrap_or_default();
            let is_on = move |limit: &Limit<X, U>| !off.contains(limit.by_command.iamax());
            limits
                .iter()
                .map(move |limit| is_on(limit).then(Row::default))
        });
        Some(Self {
            initial: transfer.initial,
            h: transfer.h,
            rows: rows.collect(),
            limits,
            by_size: Vec::new(),
            change: 0.0,
        })
    }

    /// Sets the multipliers for states `s_1 … s_N` and commands `w_1 … w_N`, by the values of the inequalities and their
    /// gradients by the command.
    pub(super) fn start(
        &mut self,
        states: &[BodyState],
        commands: &[SVector<f64, U>],
        multiplier: impl Fn(usize, f64, &SVector<f64, U>) -> f64,
    ) {
        for (interval, command) in commands.iter().enumerate() {
            let state = self.start_of(interval, states);
            for (limit, row) in self.each_mut(interval) {
                let value = limit.value(&state, command);
                row.multiplier = multiplier(interval, value, &limit.by_command);
            }
        }
    }

    fn start_of(&self, interval: usize, states: &[BodyState]) -> BodyState {
        match interval.checked_sub(1) {
            Some(before) => states[before],
            None => self.initial,
        }
    }

    /// The limits that hold in an interval, and their rows.
    fn each(&self, interval: usize) -> impl Iterator<Item = (&Limit<X, U>, &Row)> {
        let range = interval * self.limits.len()..(interval + 1) * self.limits.len();
        let all = self.limits.iter().zip(&self.rows[range]);
        all.filter_map(|(limit, row)| Some((limit, row.as_ref()?)))
    }

    fn each_mut(&mut self, interval: usize) -> impl Iterator<Item = (&Limit<X, U>, &mut Row)> {
        let range = interval * self.limits.len()..(interval + 1) * self.limits.len();
        let all = self.limits.iter().zip(&mut self.rows[range]);
        all.filter_map(|(limit, row)| Some((limit, row.as_mut()?)))
    }

    /// Adds the contributions of an interval to its model.
    pub(super) fn add(
        &mut self,
        penalty: &Penalty,
        interval: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        stage: &mut StageModel<X, U>,
    ) {
        for (limit, row) in self.each_mut(interval) {
            row.model(penalty, limit.value(state, command));
            let (by_state, by_command) = (&limit.by_state, &limit.by_command);
            stage.state += (row.weight * by_state) * by_state.transpose();
            stage.mixed += (row.weight * by_command) * by_state.transpose();
            stage.command += (row.weight * by_command) * by_command.transpose();
            stage.state_gradient += row.primal * by_state;
            stage.command_gradient += row.primal * by_command;
        }
    }

    /// `Σ y ∂g` of an interval by the state at its start and by its command.
    pub(super) fn force(
        &self,
        penalty: &Penalty,
        interval: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
    ) -> (SVector<f64, X>, SVector<f64, U>) {
        let mut force = (SVector::zeros(), SVector::zeros());
        for (limit, row) in self.each(interval) {
            let y = row.multiplier_at(penalty, limit.value(state, command));
            force.0 += y * limit.by_state;
            force.1 += y * limit.by_command;
        }
        force
    }

    /// Hands each row of an interval to `take`, with the slope of its inequality along a direction.
    pub(super) fn direct(
        &mut self,
        interval: usize,
        start: &SVector<f64, X>,
        v: &SVector<f64, U>,
        mut take: impl FnMut(&mut Row, f64),
    ) {
        let first = interval * self.limits.len();
        let all = self.limits.iter().zip(&mut self.rows[first..]);
        for (at, (limit, row)) in all.enumerate() {
            let Some(row) = row else { continue };
            let mut slope = limit.by_state.dot(start) + limit.by_command.dot(v);
            if self.change != 0.0 {
                slope += self.change * self.by_size[first + at];
            }
            take(row, slope);
        }
    }

    /// Sets the step size, and its change along the direction.
    pub(super) fn set_step_size(&mut self, h: f64, change: f64) {
        for limit in &mut self.limits {
            limit.by_command *= h / self.h;
        }
        (self.h, self.change) = (h, change);
    }

    /// What the limits add to the model of an interval as they depend on the step size.
    pub(super) fn by_step_size_in(
        &mut self,
        interval: usize,
        command: &SVector<f64, U>,
        (state_change, command_change): (&SVector<f64, X>, &SVector<f64, U>),
    ) -> BySize<X, U> {
        let mut sum = BySize::default();
        let first = interval * self.limits.len();
        self.by_size.resize(self.rows.len(), 0.0);
        let all = self.limits.iter().zip(&self.rows[first..]);
        for (at, (limit, row)) in all.enumerate() {
            let Some(row) = row else { continue };
            let Limit {
                by_state,
                by_command,
                ..
            } = limit;
            let own = by_command.dot(command) / self.h;
            let by_change = by_command.dot(command_change);
            let along = by_state.dot(state_change) + by_change;
            let y = row.multiplier / self.h;
            self.by_size[first + at] = own;
            sum.state += (row.weight * own) * by_state;
            sum.command += (row.weight * own + y) * by_command;
            sum.once += row.primal * own;
            sum.twice += row.weight * own * (own + 2.0 * along) + 2.0 * y * by_change;
        }
        sum
    }

    /// The penalty of an interval.
    pub(super) fn merit(
        &self,
        penalty: &Penalty,
        interval: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
    ) -> f64 {
        let each = self.each(interval);
        each.map(|(limit, _)| penalty.value(limit.value(state, command)))
            .sum()
    }

    /// `Σ y ∂g/∂h` for commands `w_1 … w_N`: `g` contains the command times the step size.
    pub(super) fn by_step_size(&self, commands: &[SVector<f64, U>]) -> f64 {
        let of = |(interval, command): (usize, &SVector<f64, U>)| -> f64 {
            let each = self.each(interval);
            each.map(|(limit, row)| row.multiplier * limit.by_command.dot(command))
                .sum()
        };
        commands.iter().enumerate().map(of).sum::<f64>() / self.h
    }

    /// The rows that restrict something.
    pub(super) fn rows(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().flatten()
    }

    pub(super) fn advance(&mut self, step: f64) {
        for row in self.rows.iter_mut().flatten() {
            row.multiplier += step * row.change;
        }
    }

    /// The greatest value of the current iterate.
    pub(super) fn violated(&self) -> Option<Violation> {
        self.largest(|_, _, row| row.value)
    }

    /// The greatest value for states `s_1 … s_N` and commands `w_1 … w_N`.
    pub(super) fn worst(
        &self,
        states: &[BodyState],
        commands: &[SVector<f64, U>],
    ) -> Option<Violation> {
        self.largest(|interval, limit, _| {
            limit.value(&self.start_of(interval, states), &commands[interval])
        })
    }

    fn largest(&self, value: impl Fn(usize, &Limit<X, U>, &Row) -> f64) -> Option<Violation> {
        let intervals = 0..self.rows.len() / self.limits.len();
        let all = intervals.flat_map(|interval| {
            let each = self.each(interval);
            each.map(move |(limit, row)| (interval, limit, row))
        });
        let all = all.map(|(step, limit, row)| {
            let amount = value(step, limit, row);
            Violation {
                constraint: limit.index,
                step,
                amount,
                excess: amount + limit.slack,
            }
        });
        all.max_by(|a, b| a.amount.total_cmp(&b.amount))
    }
}

impl<const X: usize, const U: usize> Limit<X, U> {
    fn value(&self, state: &BodyState, command: &SVector<f64, U>) -> f64 {
        let parts = [
            &state.position,
            &state.linear_momentum,
            &state.angular_momentum,
        ];
        let along = [0, 3, 9].map(|at| self.by_state.fixed_rows::<3>(at));
        let speed: f64 = along.iter().zip(parts).map(|(by, part)| by.dot(part)).sum();
        speed + self.by_command.dot(command) - 1.0 - self.slack
    }
}
