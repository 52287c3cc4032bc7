use std::ops::Range;

use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector, Vector3};

use super::fuel::Fuel;
use super::known::Force;
use super::penalty::Penalty;
use super::position::PositionCosts;
use super::row::Row;
use super::schedule::{BarrierTolerances, Measure, Schedule};
use super::varying::Varying;
use super::violation::Violation;
use super::wheel_speeds::WheelSpeeds;
use crate::problem::constraint::Coordinates;
use crate::problem::{CommandInequality, InequalitySet, StateInequality};
use crate::units::ROUNDING;
use crate::{MAX_COMMANDS, Transfer};

/// Inequalities of `X` coordinates and `U` commands over all intervals, with their multipliers.
pub(crate) struct Barrier<const X: usize, const U: usize> {
    pub(super) commands: Vec<CommandInequality<U>>,
    /// For each interval and command inequality, false if it does not restrict the commands there; empty if all always do.
    pub(super) restricts: Vec<bool>,
    /// What is in the place of those that do not.
    pub(super) idle: CommandInequality<U>,
    pub(super) states: Vec<Placed>,
    pub(super) schedule: Schedule,
    /// A row and its gradient for each interval and command inequality.
    pub(super) command_rows: Vec<(Row, SVector<f64, U>)>,
    /// A row for each interval and state inequality.
    pub(super) state_rows: Vec<StateRow>,
    /// Limits on the speeds of wheels, if there are any.
    pub(super) wheels: Option<WheelSpeeds<X, U>>,
    /// The cost of fuel, if commands have prices.
    pub(super) fuel: Option<Fuel<U>>,
    /// Limits and costs of commands that change from interval to interval.
    pub(super) varying: Varying<U>,
    /// The known costs of positions, if there are any.
    pub(super) positions: Option<PositionCosts>,
    /// True if the inequalities on states add nothing to the Hessian.
    pub(super) gives_way: bool,
    /// The longest step of the multipliers along the direction.
    pub(super) reach: f64,
    /// True if no step of an iterate that satisfies the inequalities covers more than a part of their slacks, as far as that leads
    /// anywhere.
    pub(super) within: bool,
    /// True if that has made a step shorter.
    pub(super) limits: bool,
    /// The longest such step along the direction.
    pub(super) room: f64,
    /// True if the iterate violates an inequality.
    pub(super) violates: bool,
    /// The slope of the penalties along the direction.
    pub(super) slope: f64,
}

/// A state inequality and the indices of its coordinates in z.
pub(super) struct Placed {
    inequality: StateInequality,
    /// The inequality at the end of each interval, if it changes with time.
    moving: Vec<StateInequality>,
    /// Those of each group of three that is planned, see [`Coordinates::groups`].
    pub(super) groups: [Option<usize>; 2],
    /// For each interval, true if the inequality applies at its end.
    applies: Vec<bool>,
    /// Intervals whose end states are not fixed.
    planned: Range<usize>,
}

impl Placed {
    pub(super) fn plans(&self, interval: usize) -> bool {
        self.applies[interval] && self.planned.contains(&interval)
    }

    /// The inequality at the end of an interval.
    pub(super) fn at(&self, interval: usize) -> &StateInequality {
        self.moving.get(interval).unwrap_or(&self.inequality)
    }

    /// The gradient at the end of an interval by each group of coordinates.
    pub(super) fn gradient(&self, interval: usize, state: &BodyState) -> [Vector3<f64>; 2] {
        let inequality = self.at(interval);
        let first = inequality.derivatives(state).0;
        let second = match self.groups[1] {
            Some(_) => inequality.by_second(state).gradient,
            None => Vector3::zeros(),
        };
        [first, second]
    }

    /// The value at the end of an interval, or `−∞` if the inequality does not apply there.
    fn value(&self, interval: usize, state: &BodyState) -> f64 {
        if self.applies[interval] {
            self.at(interval).value(state)
        } else {
            f64::NEG_INFINITY
        }
    }
}

/// The row of a state inequality at an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct StateRow {
    pub(super) row: Row,
    /// The gradient by each group of coordinates.
    pub(super) gradient: [Vector3<f64>; 2],
    /// Factor of `g` and its derivatives.
    pub(super) scale: f64,
}

/// States that are fixed by start and target.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Given {
    /// True if the pose at the end of the first step is fixed.
    pub(crate) first: bool,
    /// For position and attitude, true if the final one is fixed.
    pub(crate) last_poses: [bool; 2],
    /// For the linear and the angular momentum, true if the final one is fixed.
    pub(crate) last_momenta: [bool; 2],
}

impl Given {
    /// The intervals whose end states are planned as far as these coordinates go. `offsets` are the indices of δx and ζ in z if
    /// they are planned.
    pub(crate) fn planned(
        &self,
        coordinates: Coordinates,
        offsets: [Option<usize>; 2],
        intervals: usize,
    ) -> Range<usize> {
        let groups = coordinates.groups(offsets);
        if groups == [None; 2] {
            return 0..0;
        }
        let [position, attitude] = self.last_poses;
        let (first, last) = match coordinates {
            Coordinates::Position => (self.first, position),
            Coordinates::Attitude => (self.first, attitude),
            Coordinates::LinearMomentum => (false, self.last_momenta[0]),
            Coordinates::AngularMomentum => (false, self.last_momenta[1]),
            Coordinates::Translation => (false, position && self.last_momenta[0]),
            Coordinates::Pose => {
                let fixed = [0, 1].map(|half| groups[half].is_none() || self.last_poses[half]);
                (self.first, fixed == [true; 2])
            }
        };
        usize::from(first)..intervals - usize::from(last)
    }
}

/// Least slack assumed for the initial multipliers.
const SLACK: f64 = 0.1;

impl<const X: usize, const U: usize> Barrier<X, U> {
    /// The inequalities of `set` over the intervals of a transfer. `selection` makes the actuation's commands of the `U`
    /// planned ones, `offsets` are the indices of δx and ζ in z if they are planned, and `cost` is the size of the cost.
    pub(crate) fn new(
        set: &InequalitySet,
        transfer: &Transfer,
        selection: &SMatrix<f64, MAX_COMMANDS, U>,
        offsets: [Option<usize>; 2],
        given: Given,
        cost: f64,
        tolerances: BarrierTolerances,
    ) -> Self {
        let (h, intervals) = (transfer.h, transfer.intervals);
        let set = set.priced_by_step(h);
        let placed = |inequality: &StateInequality| {
            let coordinates = inequality.coordinates();
            Placed {
                inequality: inequality.clone(),
                moving: inequality.through(h, intervals),
                groups: coordinates.groups(offsets),
                applies: inequality.applies(intervals),
                planned: given.planned(coordinates, offsets, intervals),
            }
        };
        let commands: Vec<_> = set.command.iter().map(|row| row.of(selection)).collect();
        let states: Vec<_> = set.state.iter().map(placed).collect();
        let planned = |placed: &Placed| (0..intervals).filter(|&at| placed.plans(at)).count();
        let planned: usize = states.iter().map(planned).sum();
        let wheels = WheelSpeeds::new(transfer, &set, selection);
        let of_wheels = wheels.iter().flat_map(WheelSpeeds::rows).count();
        let rows = planned + intervals * commands.len() + of_wheels;
        let schedule = Schedule::new(cost, rows, tolerances);
        let minimizes_fuel = transfer.actuation.minimizes_fuel();
        let fuel = minimizes_fuel.then(|| Fuel::new(transfer, &set, selection, &schedule));
        let row = StateRow {
            row: Row::default(),
            gradient: [Vector3::zeros(); 2],
            scale: 1.0,
        };
        Self {
            command_rows: vec![(Row::default(), SVector::zeros()); intervals * commands.len()],
            state_rows: vec![row; intervals * states.len()],
            schedule,
            restricts: restricts(&commands, transfer, selection),
            idle: CommandInequality::idle(),
            commands,
            states,
            wheels,
            fuel,
            varying: Varying::new(transfer, selection),
            positions: PositionCosts::new(&set.position_costs, offsets[0]),
            gives_way: false,
            reach: 1.0,
            within: true,
            limits: false,
            room: 1.0,
            violates: false,
            slope: 0.0,
        }
    }

    /// Sets whether steps of an iterate that satisfies the inequalities leave a part of their slacks.
    pub(crate) fn keep_within(&mut self, within: bool) {
        self.within = within;
    }

    /// Whether a step was shorter for that.
    pub(crate) fn has_limited(&self) -> bool {
        self.limits
    }

    /// The inequalities on the commands of an interval.
    #[inline]
    pub(super) fn commands_in(
        &self,
        interval: usize,
    ) -> impl Iterator<Item = &CommandInequality<U>> {
        in_interval(&self.commands, &self.restricts, &self.idle, interval)
    }

    /// Initializes the multipliers for states `s_1 … s_N` and commands `w_1 … w_N`; fuel costs `smooth`ly at first.
    pub(crate) fn start(
        &mut self,
        states: &[BodyState],
        commands: &[SVector<f64, U>],
        smooth: bool,
    ) {
        if let Some(fuel) = self.fuel.as_mut().filter(|_| smooth) {
            self.schedule.start_smoothly(fuel.least_at_limit());
            fuel.smooth_from(self.schedule.penalty.beta);
        }
        self.each(states, commands, |penalty, row, value, _| {
            row.multiplier = penalty.start(value, SLACK);
        });
        if let Some(wheels) = &mut self.wheels {
            let penalty = &self.schedule.penalty;
            wheels.start(states, commands, |_, value, _| penalty.start(value, SLACK));
        }
        if let Some(fuel) = &mut self.fuel {
            fuel.start(self.schedule.penalty.beta, commands);
        }
    }

    /// Initializes the multipliers near a solution, with β at this `part` of the share of the cost per inequality. `forces` holds
    /// `Σ y ∂g/∂z` and `Σ y ∂g/∂w` of every interval; each multiplier is computed as if its inequality were the only one of the
    /// interval.
    pub(crate) fn resume(
        &mut self,
        states: &[BodyState],
        commands: &[SVector<f64, U>],
        forces: &[Force<X, U>],
        part: f64,
    ) {
        self.schedule.start_at(part);
        let beta = self.schedule.penalty.beta;
        let mut fuel = self.fuel.take();
        if let Some(fuel) = &mut fuel {
            fuel.start(beta, commands);
        }
        let varying = self.varying.clone();
        let positions = self.positions.take();
        let charged = |interval: usize| {
            let mut force = SVector::zeros();
            if let Some(positions) = &positions {
                positions.add_force(interval, &mut force);
            }
            force
        };
        let paid = |interval: usize| {
            let (fuel, command) = (fuel.as_ref(), &commands[interval]);
            let paid = fuel.map_or_else(SVector::zeros, |fuel| fuel.force(beta, command));
            varying.cost(interval).map_or(paid, |cost| paid + cost)
        };
        self.each(states, commands, |penalty, row, value, along| {
            let least = penalty.start(value, SLACK);
            let Force { state, command } = &forces[along.interval];
            let (force, size) = match along.gradient {
                Gradient::State(groups, g) => {
                    let state = state - charged(along.interval);
                    let parts = groups.iter().zip(&g);
                    let parts = parts.filter_map(|(group, g)| {
                        Some((g.dot(&state.fixed_rows::<3>((*group)?)), g.norm_squared()))
                    });
                    parts.fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1))
                }
                Gradient::Command(g) => {
                    let own = command - paid(along.interval);
                    (g.dot(&own), g.norm_squared())
                }
            };
            if size > 0.0 {
                row.multiplier = (force / size).clamp(least, 0.5 * penalty.rho);
            }
        });
        if let Some(wheels) = &mut self.wheels {
            let penalty = &self.schedule.penalty;
            wheels.start(states, commands, |interval, value, gradient| {
                let own = forces[interval].command - paid(interval);
                let least = penalty.start(value, SLACK);
                let along = gradient.dot(&own) / gradient.norm_squared();
                along.clamp(least, 0.5 * penalty.rho)
            });
        }
        self.fuel = fuel;
        self.positions = positions;
    }

    /// The multipliers of each inequality on states at the ends of the intervals.
    pub(super) fn by_row(&self) -> Vec<Vec<f64>> {
        let count = self.states.len();
        let row = |(which, placed): (usize, &Placed)| {
            let rows = self.state_rows.iter().skip(which).step_by(count);
            let multiplier = |(interval, state): (usize, &StateRow)| {
                if placed.plans(interval) {
                    state.row.multiplier * state.scale
                } else {
                    0.0
                }
            };
            rows.enumerate().map(multiplier).collect()
        };
        self.states.iter().enumerate().map(row).collect()
    }

    /// The largest violation of states `s_1 … s_N` where they are fixed, or `None` if it is within the tolerance.
    pub(crate) fn given_violation(
        &self,
        states: &[BodyState],
        end: &BodyState,
    ) -> Option<Violation> {
        let mut worst = None::<Violation>;
        let last = states.len() - 1;
        for placed in &self.states {
            for (step, state) in states.iter().enumerate() {
                let state = if step == last { end } else { state };
                let amount = placed.value(step, state);
                let most = worst.map_or(self.schedule.tolerances.violation, |worst| worst.amount);
                let forbidden = placed.inequality.price.is_none();
                if forbidden && !placed.plans(step) && amount > most {
                    let constraint = placed.inequality.index;
                    worst = Some(Violation {
                        constraint,
                        step,
                        amount,
                        excess: placed.at(step).excess(amount),
                    });
                }
            }
        }
        worst
    }

    /// The sum of the products of slack and multiplier, if each is that of the barrier or at most twice as large.
    pub(crate) fn products(&self) -> Option<f64> {
        let now = self.measure();
        (now.gap <= self.schedule.penalty.beta).then_some(now.products)
    }

    /// The largest violation of the current iterate, or `None` if it is within the tolerance.
    pub(crate) fn violated(&self) -> Option<Violation> {
        let commands = self.command_rows.iter().map(|(row, _)| row.value);
        let states = self.state_rows.iter();
        let states = states.map(|state| state.row.value / state.scale);
        let of_wheels = self.wheels.as_ref().and_then(WheelSpeeds::violated);
        self.largest(commands, states, of_wheels)
    }

    /// The largest violation of states `s_1 … s_N` and commands `w_1 … w_N`, or `None` if it is within the tolerance.
    pub(crate) fn worst(
        &self,
        states: &[BodyState],
        commands: &[SVector<f64, U>],
    ) -> Option<Violation> {
        let of_commands = commands.iter().enumerate().flat_map(|(interval, command)| {
            let command = self.varying.share(interval) * command;
            let rows = self.commands_in(interval);
            rows.map(move |row| row.value(&command))
        });
        let of_states = states.iter().enumerate().flat_map(|(interval, state)| {
            let rows = self.states.iter();
            rows.map(move |placed| placed.value(interval, state))
        });
        let wheels = self.wheels.as_ref();
        let of_wheels = wheels.and_then(|wheels| wheels.worst(states, commands));
        self.largest(of_commands, of_states, of_wheels)
    }

    /// The largest of values by interval and inequality, or `None` if it is within the tolerance.
    fn largest(
        &self,
        commands: impl Iterator<Item = f64>,
        states: impl Iterator<Item = f64>,
        wheels: Option<Violation>,
    ) -> Option<Violation> {
        let of_commands = commands.enumerate().filter_map(|(at, amount)| {
            let inequality = &self.commands[at % self.commands.len()];
            inequality.price.is_none().then(|| Violation {
                constraint: inequality.index,
                step: at / self.commands.len(),
                amount,
                excess: inequality.excess(amount),
            })
        });
        let of_states = states.enumerate().filter_map(|(at, amount)| {
            let step = at / self.states.len();
            let inequality = self.states[at % self.states.len()].at(step);
            inequality.price.is_none().then(|| Violation {
                constraint: inequality.index,
                step,
                amount,
                excess: inequality.excess(amount),
            })
        });
        let worst = of_commands
            .chain(of_states)
            .chain(wheels)
            .max_by(|a, b| a.amount.total_cmp(&b.amount))?;
        (worst.amount > self.schedule.tolerances.violation).then_some(worst)
    }

    /// The errors of the subproblem at the current iterate.
    pub(super) fn measure(&self) -> Measure {
        let mut now = Measure::default();
        let rows = self.command_rows.chunks(self.commands.len().max(1));
        for (interval, rows) in rows.enumerate() {
            for ((row, _), inequality) in rows.iter().zip(self.commands_in(interval)) {
                now.take(row, inequality.price, 0.0);
            }
        }
        let count = self.states.len();
        for (at, StateRow { row, scale, .. }) in self.state_rows.iter().enumerate() {
            let placed = &self.states[at % count];
            if placed.plans(at / count) {
                let rounding = scale * ROUNDING / placed.inequality.size();
                now.take(row, placed.inequality.price, rounding);
            }
        }
        for row in self.wheels.iter().flat_map(WheelSpeeds::rows) {
            now.take(row, None, 0.0);
        }
        now
    }

    /// Calls `visit` for every planned row with the value and the gradient of its inequality.
    fn each(
        &mut self,
        states: &[BodyState],
        commands: &[SVector<f64, U>],
        mut visit: impl FnMut(&Penalty, &mut Row, f64, Along<U>),
    ) {
        let count = self.commands.len().max(1);
        let rows = self.command_rows.chunks_mut(count);
        for (interval, (rows, command)) in rows.zip(commands).enumerate() {
            let share = self.varying.share(interval);
            let command = share * command;
            let all = in_interval(&self.commands, &self.restricts, &self.idle, interval);
            for ((row, _), inequality) in rows.iter_mut().zip(all) {
                let gradient = Gradient::Command(share * inequality.gradient(&command));
                let along = Along { interval, gradient };
                let penalty = self.schedule.penalty.of(inequality.price);
                visit(&penalty, row, inequality.value(&command), along);
            }
        }
        let count = self.states.len();
        for (at, StateRow { row, scale, .. }) in self.state_rows.iter_mut().enumerate() {
            let (interval, placed) = (at / count, &self.states[at % count]);
            if placed.plans(interval) {
                let state = &states[interval];
                let inequality = placed.at(interval);
                *scale = match inequality.price {
                    None => inequality.scale(state),
                    Some(_) => 1.0,
                };
                let gradient = placed.gradient(interval, state).map(|part| *scale * part);
                let gradient = Gradient::State(placed.groups, gradient);
                let along = Along { interval, gradient };
                let value = *scale * inequality.value(state);
                let penalty = self.schedule.penalty.of(inequality.price);
                visit(&penalty, row, value, along);
            }
        }
    }
}

/// The inequalities on the commands of an interval, `idle` in the place of those that do not restrict them.
#[inline]
pub(super) fn in_interval<'b, const U: usize>(
    all: &'b [CommandInequality<U>],
    restricts: &'b [bool],
    idle: &'b CommandInequality<U>,
    interval: usize,
) -> impl Iterator<Item = &'b CommandInequality<U>> {
    let own = restricts.get(interval * all.len()..).unwrap_or_default();
    let each = all.iter().enumerate();
    each.map(move |(at, row)| match own.get(at) {
        Some(false) => idle,
        _ => row,
    })
}

/// [`Barrier::restricts`]
fn restricts<const U: usize>(
    all: &[CommandInequality<U>],
    transfer: &Transfer,
    selection: &SMatrix<f64, MAX_COMMANDS, U>,
) -> Vec<bool> {
    let windows = all.iter().any(|row| row.window.is_some());
    if !windows && transfer.off.is_none() {
        return Vec::new();
    }
    let off = transfer.off_by_step(|own| {
        let column = (own < U).then(|| selection.column(own))?;
        column.iter().position(|entry| *entry != 0.0)
    });
    let intervals = transfer.intervals;
    let steps = (0..intervals).map(|step| (step, off.get(step).copied().unwrap_or_default()));
    let each = steps.flat_map(|(step, off)| {
        all.iter()
            .map(move |row| row.restricts(step, intervals, off))
    });
    each.collect()
}

/// The interval and the gradient of a row.
struct Along<const U: usize> {
    interval: usize,
    gradient: Gradient<U>,
}

enum Gradient<const U: usize> {
    /// By groups of three coordinates of z, each starting at an index.
    State([Option<usize>; 2], [Vector3<f64>; 2]),
    Command(SVector<f64, U>),
}
