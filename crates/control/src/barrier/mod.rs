//! The interior point method on the stages: inequalities as smoothed exact penalties whose β falls, their multipliers
//! and slacks eliminated stage by stage, so that a step is still one linear-quadratic problem.
//!
//! The iterate need not satisfy the inequalities: a violation costs ρ, and ρ rises where multipliers come near it. Where
//! no ρ helps, the inequalities are infeasible (Curtis' penalty interior point method, with slacks at their best).

mod penalty;
mod row;
mod schedule;

use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector, Vector3};

use crate::newton::{Inequalities, Satisfied};
use crate::problem::{CommandInequality, InequalitySet, Place, StateInequality};
use penalty::Penalty;
use row::Row;
pub(crate) use schedule::BarrierTolerances;
use schedule::Schedule;

/// Inequalities of `X` coordinates and `U` commands over all intervals, with their multipliers.
pub(crate) struct Barrier<const X: usize, const U: usize> {
    commands: Vec<CommandInequality<U>>,
    states: Vec<Placed>,
    schedule: Schedule,
    /// A row for each interval and command inequality, and the gradient there.
    command_rows: Vec<(Row, SVector<f64, U>)>,
    /// A row for each interval and state inequality, and the gradient there.
    state_rows: Vec<(Row, Vector3<f64>)>,
    intervals: usize,
    /// Along the last direction: the longest step of the multipliers and the slope of the penalty.
    reach: f64,
    slope: f64,
}

/// An inequality on the state, and where its place lies in z.
struct Placed {
    inequality: StateInequality,
    offset: usize,
    /// Intervals at whose ends there is something to plan.
    from: usize,
    to: usize,
}

/// Which states nothing is left to plan of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Given {
    /// Pose at the end of the first step.
    pub(crate) first: bool,
    /// Position at the end.
    pub(crate) last_position: bool,
    /// Attitude at the end.
    pub(crate) last_attitude: bool,
}

/// An inequality that does not hold, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Violation {
    /// Which constraint, from 0.
    pub(crate) constraint: usize,
    /// At the end of, or during, which step, from 0.
    pub(crate) step: usize,
    /// `g`
    pub(crate) amount: f64,
}

/// How near to 0 or ρ a multiplier may go in a step.
const BOUNDARY: f64 = 0.995;

/// The slack that a multiplier starts from at least.
const SLACK: f64 = 0.1;

impl<const X: usize, const U: usize> Barrier<X, U> {
    /// Those of `set` where `selection` makes all commands of the `U` that are planned and `offsets` say where δx and ζ
    /// lie in z, if at all; `scale` is the size of the cost.
    pub(crate) fn new(
        set: &InequalitySet,
        selection: &SMatrix<f64, 6, U>,
        offsets: [Option<usize>; 2],
        given: Given,
        intervals: usize,
        scale: f64,
        tolerances: BarrierTolerances,
    ) -> Self {
        let commands: Vec<_> = set.command.iter().map(|row| row.of(selection)).collect();
        let states: Vec<_> = set
            .state
            .iter()
            .filter_map(|inequality| {
                let (offset, last) = match inequality.place() {
                    Place::Position => (offsets[0]?, given.last_position),
                    Place::Attitude => (offsets[1]?, given.last_attitude),
                };
                Some(Placed {
                    inequality: inequality.clone(),
                    offset,
                    from: usize::from(given.first),
                    to: intervals - usize::from(last),
                })
            })
            .collect();
        let rows = intervals * commands.len()
            + states
                .iter()
                .map(|p| p.to.saturating_sub(p.from))
                .sum::<usize>();
        let row = Row::default();
        Self {
            command_rows: vec![(row, SVector::zeros()); intervals * commands.len()],
            state_rows: vec![(row, Vector3::zeros()); intervals * states.len()],
            schedule: Schedule::new(scale, rows, tolerances),
            commands,
            states,
            intervals,
            reach: 1.0,
            slope: 0.0,
        }
    }

    /// Starts the multipliers at the states `s_1 … s_N` and commands `w_1 … w_N`.
    pub(crate) fn start(&mut self, states: &[BodyState], commands: &[SVector<f64, U>]) {
        let penalty = self.schedule.penalty;
        for k in 0..self.intervals {
            for (i, inequality) in self.commands.iter().enumerate() {
                let value = inequality.value(&commands[k]);
                let row = &mut self.command_rows[k * self.commands.len() + i].0;
                *row = Row::start(&penalty, value, SLACK);
            }
            for (i, placed) in self.states.iter().enumerate() {
                let value = placed.inequality.value(&states[k]);
                let row = &mut self.state_rows[k * self.states.len() + i].0;
                *row = Row::start(&penalty, value, SLACK);
            }
        }
    }

    /// The largest violation of the present iterate.
    pub(crate) fn worst(&self) -> Option<Violation> {
        let commands = self
            .command_rows
            .iter()
            .enumerate()
            .map(|(at, (row, _))| Violation {
                constraint: self.commands[at % self.commands.len()].constraint,
                step: at / self.commands.len(),
                amount: row.value,
            });
        let states = self
            .state_rows
            .iter()
            .enumerate()
            .map(|(at, (row, _))| Violation {
                constraint: self.states[at % self.states.len()].inequality.constraint,
                step: at / self.states.len(),
                amount: row.value,
            });
        commands.chain(states).reduce(|worst, next| {
            if next.amount > worst.amount {
                next
            } else {
                worst
            }
        })
    }

    fn all_rows(&self) -> impl Iterator<Item = &Row> {
        let commands = self.command_rows.iter().map(|(row, _)| row);
        let states = self.states.len();
        let planned = self
            .state_rows
            .iter()
            .enumerate()
            .filter_map(move |(at, (row, _))| {
                let placed = &self.states[at % states];
                placed.plans(at / states).then_some(row)
            });
        commands.chain(planned)
    }
}

impl Placed {
    fn plans(&self, interval: usize) -> bool {
        (self.from..self.to).contains(&interval)
    }
}

impl<const X: usize, const U: usize> Inequalities<X, U> for Barrier<X, U> {
    fn add_state(
        &mut self,
        interval: usize,
        state: &BodyState,
        curvature: f64,
        hessian: &mut SMatrix<f64, X, X>,
        gradient: &mut SVector<f64, X>,
    ) {
        let count = self.states.len();
        let rows = &mut self.state_rows[interval * count..(interval + 1) * count];
        for (placed, (row, slope)) in self.states.iter().zip(rows) {
            if !placed.plans(interval) {
                continue;
            }
            let inequality = &placed.inequality;
            row.model(&self.schedule.penalty, inequality.value(state));
            let (by_place, twice) = inequality.derivatives(state);
            *slope = by_place;
            let share = if inequality.is_convex() {
                1.0
            } else {
                curvature
            };
            let added =
                (share * row.multiplier) * twice + (row.weight * by_place) * by_place.transpose();
            let mut block = hessian.fixed_view_mut::<3, 3>(placed.offset, placed.offset);
            block += added;
            let mut part = gradient.fixed_rows_mut::<3>(placed.offset);
            part += row.primal * by_place;
        }
    }

    fn add_command(
        &mut self,
        interval: usize,
        command: &SVector<f64, U>,
        hessian: &mut SMatrix<f64, U, U>,
        gradient: &mut SVector<f64, U>,
    ) {
        let count = self.commands.len();
        let rows = &mut self.command_rows[interval * count..(interval + 1) * count];
        for (inequality, (row, slope)) in self.commands.iter().zip(rows) {
            row.model(&self.schedule.penalty, inequality.value(command));
            *slope = inequality.gradient(command);
            *hessian +=
                row.multiplier * inequality.hessian() + (row.weight * *slope) * slope.transpose();
            *gradient += row.primal * *slope;
        }
    }

    fn state_force(&self, interval: usize, state: &BodyState) -> SVector<f64, X> {
        let count = self.states.len();
        let rows = &self.state_rows[interval * count..(interval + 1) * count];
        let mut force = SVector::<f64, X>::zeros();
        for (placed, (row, _)) in self.states.iter().zip(rows) {
            if placed.plans(interval) {
                let value = placed.inequality.value(state);
                let (by_place, _) = placed.inequality.derivatives(state);
                let y = row.multiplier_at(&self.schedule.penalty, value);
                let mut part = force.fixed_rows_mut::<3>(placed.offset);
                part += y * by_place;
            }
        }
        force
    }

    fn command_force(&self, interval: usize, command: &SVector<f64, U>) -> SVector<f64, U> {
        let count = self.commands.len();
        let rows = &self.command_rows[interval * count..(interval + 1) * count];
        let mut force = SVector::zeros();
        for (inequality, (row, _)) in self.commands.iter().zip(rows) {
            let y = row.multiplier_at(&self.schedule.penalty, inequality.value(command));
            force += y * inequality.gradient(command);
        }
        force
    }

    fn direct(&mut self, interval: usize, z: &SVector<f64, X>, v: &SVector<f64, U>) {
        if interval == 0 {
            self.reach = 1.0;
            self.slope = 0.0;
        }
        let penalty = &self.schedule.penalty;
        let mut take = |row: &mut Row, along: f64| {
            row.direct(along);
            self.reach = self.reach.min(row.reach(penalty, BOUNDARY));
            self.slope += row.primal * along;
        };
        let count = self.commands.len();
        for (row, gradient) in &mut self.command_rows[interval * count..(interval + 1) * count] {
            take(row, gradient.dot(v));
        }
        let count = self.states.len();
        let rows = &mut self.state_rows[interval * count..(interval + 1) * count];
        for (placed, (row, gradient)) in self.states.iter().zip(rows) {
            if placed.plans(interval) {
                take(row, gradient.dot(&z.fixed_rows::<3>(placed.offset)));
            }
        }
    }

    fn reach(&self) -> (f64, f64) {
        (1.0, self.reach)
    }

    fn merit(
        &self,
        interval: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        _: f64,
    ) -> (f64, f64) {
        let penalty = &self.schedule.penalty;
        let mut sum = 0.0;
        for inequality in &self.commands {
            sum += penalty.value(inequality.value(command));
        }
        for placed in &self.states {
            if placed.plans(interval) {
                sum += penalty.value(placed.inequality.value(state));
            }
        }
        (sum, 0.0)
    }

    fn slope(&self) -> f64 {
        self.slope
    }

    fn advance(&mut self, _: f64, dual: f64) {
        for (row, _) in &mut self.command_rows {
            row.multiplier += dual * row.change;
        }
        for (row, _) in &mut self.state_rows {
            row.multiplier += dual * row.change;
        }
    }

    fn residuals(&self) -> (f64, f64) {
        self.all_rows()
            .fold((0.0, 0.0), |(violation, product), row| {
                (
                    f64::max(violation, row.value),
                    f64::max(product, row.product),
                )
            })
    }

    fn tighten(&mut self, error: f64) -> bool {
        let (mut gap, mut largest, mut violation) = (0.0_f64, 0.0_f64, 0.0_f64);
        for row in self.all_rows() {
            gap = gap.max(row.gap);
            largest = largest.max(row.multiplier);
            violation = violation.max(row.value);
        }
        self.schedule.tighten(error, gap, largest, violation)
    }

    fn satisfied(&self) -> Satisfied {
        let (violation, product) = <Self as Inequalities<X, U>>::residuals(self);
        let largest = self.all_rows().fold(0.0, |most, row| f64::max(most, row.multiplier));
        self.schedule.satisfied(violation, product, largest)
    }
}
