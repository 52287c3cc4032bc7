use std::sync::Arc;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, SMatrix, Vector3};

use super::{
    BySecond, CommandInequality, Constraint, Coordinates, StateConstraint, WheelSpeed, Window,
    resampled,
};
use crate::problem::{Actuation, Command, MAX_COMMANDS, TerminalSet};
use crate::units::Units;

/// All inequalities of a transfer.
#[derive(Clone, Debug, Default)]
pub(crate) struct InequalitySet {
    /// Inequalities on each interval's commands.
    pub(crate) command: Vec<CommandInequality>,
    /// Inequalities on the state at the end of each step.
    pub(crate) state: Vec<StateInequality>,
    /// Limits on the speeds of wheels.
    pub(crate) wheels: Vec<WheelSpeed>,
    /// True if those on states hold at the ends of steps only.
    pub(crate) only_at_ends: bool,
    /// A known cost of the position at the end of each interval, beside the inequalities; empty if there is none.
    pub(crate) position_costs: Arc<[PositionCost]>,
}

/// A known cost `f · (x − r)` of a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PositionCost {
    /// `f`
    pub(crate) price: Vector3<f64>,
    /// `r`, near which the cost is not rounded.
    pub(crate) reference: Vector3<f64>,
}

/// A state constraint of a transfer in its own units.
#[derive(Clone, Debug)]
pub(crate) struct StateInequality {
    /// The index of the constraint.
    pub(crate) index: usize,
    constraint: Arc<dyn StateConstraint>,
    /// The units of the transfer's states, expressed in the units of the constraint.
    units: Units,
    /// The allowed violation.
    slack: f64,
    /// By how much it is tightened at the end of each interval; empty if it is nowhere.
    margins: Arc<[f64]>,
    /// By how much deviations may raise `g` at the states `0 … N`; empty if it holds without a probability.
    spread: Arc<[f64]>,
    /// Time of the transfer's start, in the units of the constraint.
    start: f64,
    /// The price of a violation per unit of time, if it is not forbidden.
    pub(crate) price: Option<f64>,
    /// The steps in which it holds, if it does not hold in all.
    window: Option<Window>,
    /// True if it is not followed between the ends of steps.
    pub(crate) only_at_ends: bool,
    /// The positions at `0 … N` in the units of the constraint, if those of the states are others.
    orbit: Option<Arc<[Vector3<f64>]>>,
    /// That at the end of the interval which the inequality belongs to.
    position: Option<Vector3<f64>>,
}

/// For each command, the size that rows without a price allow it alone in all steps, or infinity.
pub(in crate::problem) fn command_limits<'r>(
    rows: impl IntoIterator<Item = &'r CommandInequality>,
) -> Command {
    let always = |row: &&CommandInequality| row.price.is_none() && row.window.is_none();
    let hard = rows.into_iter().filter(always);
    hard.fold(Command::repeat(f64::INFINITY), |limits, row| {
        limits.inf(&row.limits())
    })
}

impl InequalitySet {
    /// The inequalities of `constraints` for an actuation, a start and a target, in a transfer of `intervals` steps.
    pub(crate) fn new(
        constraints: &[Constraint],
        actuation: &Actuation,
        initial: &BodyState,
        target: &TerminalSet,
        intervals: usize,
    ) -> Self {
        let mut end = *initial;
        target.aim(&mut end);
        let end = target.translation.fixes_pose().then_some(&end.position);
        let mut all = Self::default();
        for (index, constraint) in constraints.iter().enumerate() {
            let price = constraint.price();
            let steps = constraint.steps();
            let window = steps
                .as_ref()
                .and_then(|steps| Window::new(steps, intervals));
            if steps.is_some() && window.is_none() {
                continue;
            }
            match constraint.bare() {
                Constraint::Priced(_) | Constraint::During(_) => (),
                Constraint::Commands(constraint) => {
                    for mut row in constraint.inequalities(actuation) {
                        row.index = index;
                        row.price = price;
                        row.window = window;
                        all.command.push(row);
                    }
                }
                Constraint::State(constraint) => {
                    let adapted = constraint.between(&initial.position, end);
                    let constraint = adapted.unwrap_or_else(|| constraint.clone());
                    let row = StateInequality::new(index, constraint, price);
                    all.state.push(StateInequality { window, ..row });
                }
            }
        }
        all
    }

    /// For each command, true if it must not be negative in any step.
    pub(crate) fn one_sided(&self) -> [bool; MAX_COMMANDS] {
        let mut one_sided = [false; MAX_COMMANDS];
        let always = self.command.iter().filter(|row| row.window.is_none());
        let sides = always.filter_map(CommandInequality::one_sided);
        sides.for_each(|command| one_sided[command] = true);
        one_sided
    }

    /// The prices of violations, of each inequality that has one.
    pub(crate) fn prices(&self) -> impl Iterator<Item = f64> {
        let commands = self.command.iter().map(|row| row.price);
        let states = self.state.iter().map(|row| row.price);
        commands.chain(states).flatten()
    }

    /// For each command, the size that the inequalities allow it alone in all steps, or infinity.
    pub(crate) fn command_limits(&self) -> Command {
        command_limits(&self.command)
    }

    /// Those on states, at the ends of steps, if any of them holds in some steps only.
    pub(crate) fn on_states_in_phases(&self) -> Option<Self> {
        let mut state = self.state.iter();
        state.any(|row| row.window.is_some()).then(|| Self {
            command: Vec::new(),
            state: self.state.clone(),
            wheels: Vec::new(),
            only_at_ends: true,
            position_costs: Arc::default(),
        })
    }

    /// True if there are no inequalities and no costs of positions.
    pub(crate) fn is_empty(&self) -> bool {
        self.command.is_empty()
            && self.state.is_empty()
            && self.wheels.is_empty()
            && self.position_costs.is_empty()
    }

    /// The inequalities, those that depend on positions at the positions of an orbit, whatever is in their place in states.
    pub(crate) fn along(&self, orbit: &Arc<[Vector3<f64>]>) -> Self {
        let placed = |row: &StateInequality| StateInequality {
            orbit: row
                .coordinates()
                .depend_on_position()
                .then(|| orbit.clone()),
            ..row.clone()
        };
        Self {
            state: self.state.iter().map(placed).collect(),
            ..self.clone()
        }
    }

    /// Adds an inequality on states at the ends of steps, as the constraint with this index.
    pub(crate) fn add_at_ends(&mut self, index: usize, constraint: Arc<dyn StateConstraint>) {
        self.state.push(StateInequality {
            only_at_ends: true,
            ..StateInequality::new(index, constraint, None)
        });
    }

    /// The index after those of all constraints.
    pub(crate) fn next_index(&self) -> usize {
        let commands = self.command.iter().map(|row| row.index);
        let indices = commands.chain(self.state.iter().map(|row| row.index));
        indices.max().map_or(0, |last| last + 1)
    }

    /// The inequalities of the transfer in its own units.
    pub(crate) fn in_units(&self, units: &Units) -> Self {
        let commands = SMatrix::from_diagonal(units.commands());
        let price = |price: Option<f64>| price.map(|price| price * (units.time() / units.cost()));
        let state = |row: &StateInequality| StateInequality {
            units: *units,
            price: price(row.price),
            ..row.clone()
        };
        Self {
            command: self
                .command
                .iter()
                .map(|row| {
                    let mut own = row.of(&commands).normalized();
                    own.price = price(row.price);
                    own
                })
                .collect(),
            state: self.state.iter().map(state).collect(),
            wheels: self.wheels.iter().map(|row| row.in_units(units)).collect(),
            only_at_ends: self.only_at_ends,
            position_costs: self.position_costs_in_units(units),
        }
    }

    fn position_costs_in_units(&self, units: &Units) -> Arc<[PositionCost]> {
        let [own_price, own_length] = [units.length() / units.cost(), units.length().recip()];
        let costs = self.position_costs.iter().map(|cost| PositionCost {
            price: own_price * cost.price,
            reference: own_length * cost.reference,
        });
        costs.collect()
    }

    /// The inequalities with the prices of violations in a step of length `h`.
    pub(crate) fn priced_by_step(&self, h: f64) -> Self {
        let mut all = self.clone();
        let commands = all.command.iter_mut().map(|row| &mut row.price);
        let states = all.state.iter_mut().map(|row| &mut row.price);
        commands
            .chain(states)
            .flatten()
            .for_each(|price| *price *= h);
        all
    }

    /// The inequalities of the transfer that starts so many intervals of length `h` later.
    pub(crate) fn later(&self, h: f64, intervals: usize) -> Self {
        // None within if it always holds, and none at all if its steps are over.
        let rest = |window: Option<Window>| match window {
            None => Some(None),
            Some(window) => window.later(intervals).map(Some),
        };
        let command = |row: &CommandInequality| {
            let mut own = row.clone();
            own.window = rest(row.window)?;
            Some(own)
        };
        let state = |row: &StateInequality| {
            Some(StateInequality {
                start: row.start + h * intervals as f64,
                margins: later(&row.margins, intervals),
                spread: later(&row.spread, intervals),
                window: rest(row.window)?,
                ..row.clone()
            })
        };
        Self {
            command: self.command.iter().filter_map(command).collect(),
            state: self.state.iter().filter_map(state).collect(),
            wheels: self.wheels.clone(),
            only_at_ends: self.only_at_ends,
            position_costs: later(&self.position_costs, intervals),
        }
    }

    /// The inequalities, those on states tightened at the end of each interval: `g ≤ −margin`. There is one list of margins
    /// by interval for each of them.
    pub(crate) fn tightened(&self, margins: Vec<Vec<f64>>) -> Self {
        let rows = self.state.iter().zip(margins);
        let state = rows.map(|(row, margins)| StateInequality {
            margins: margins.into(),
            ..row.clone()
        });
        Self {
            state: state.collect(),
            ..self.clone()
        }
    }

    /// The inequalities, those on states with what deviations may add at the states `0 … N`: `g + spread ≤ 0`.
    pub(crate) fn spread(&self, spreads: Vec<Vec<f64>>) -> Self {
        let mut all = self.clone();
        for (row, spread) in all.state.iter_mut().zip(spreads) {
            row.spread = spread.into();
        }
        all
    }

    /// The inequalities, each relaxed by `slack`: `g ≤ slack`; those with a price stay.
    pub(crate) fn relaxed(&self, slack: f64) -> Self {
        let state = |row: &StateInequality| StateInequality {
            slack: match row.price {
                None => row.slack + slack,
                Some(_) => row.slack,
            },
            ..row.clone()
        };
        Self {
            command: self.command.iter().map(|row| row.relaxed(slack)).collect(),
            state: self.state.iter().map(state).collect(),
            wheels: self.wheels.iter().map(|row| row.relaxed(slack)).collect(),
            ..self.clone()
        }
    }
}

/// What follows the first `count` items.
fn later<T: Clone>(all: &[T], count: usize) -> Arc<[T]> {
    all.get(count..).unwrap_or_default().into()
}

impl StateInequality {
    fn new(index: usize, constraint: Arc<dyn StateConstraint>, price: Option<f64>) -> Self {
        Self {
            index,
            constraint,
            units: Units::ones(),
            slack: 0.0,
            margins: Arc::default(),
            spread: Arc::default(),
            start: 0.0,
            price,
            window: None,
            only_at_ends: false,
            orbit: None,
            position: None,
        }
    }

    /// The coordinates that it depends on.
    pub(crate) fn coordinates(&self) -> Coordinates {
        self.constraint.coordinates()
    }

    /// The part of one of `intervals` intervals, between numbers from 0 to 1, in which the inequality applies; without length if
    /// it does not.
    pub(crate) fn within(&self, interval: usize, intervals: usize) -> [f64; 2] {
        let range = self.constraint.applies();
        let part = |end: &f64| (end * intervals as f64 - interval as f64).clamp(0.0, 1.0);
        let [from, to] = [part(range.start()), part(range.end())];
        let [least, most] = match &self.window {
            Some(window) => window.within(interval, intervals),
            None => [0.0, 1.0],
        };
        [from.max(least), to.min(most)]
    }

    /// For each of `intervals` intervals, true if the inequality applies at its end.
    pub(crate) fn applies(&self, intervals: usize) -> Vec<bool> {
        let range = self.constraint.applies();
        let holds = |end: usize| {
            let mut window = self.window.iter();
            range.contains(&(end as f64 / intervals as f64))
                && window.all(|window| window.holds_at(end, intervals))
        };
        (1..=intervals).map(holds).collect()
    }

    /// The inequality at the end of each of `intervals` intervals of length `h`, or nothing if it is always the same.
    pub(crate) fn through(&self, h: f64, intervals: usize) -> Vec<Self> {
        let h = h * self.units.time();
        let orbit = self.orbit.as_ref();
        let orbit = orbit.map(|orbit| resampled(orbit, intervals));
        let at = |end: usize| {
            let moved = self.constraint.at(self.start + h * end as f64);
            let margin = self.margins.get(end - 1);
            let unmoved = moved.is_none() && margin.is_none() && self.spread.is_empty();
            if unmoved && orbit.is_none() {
                return None;
            }
            let margin = margin.unwrap_or(&0.0) + self.spread_at(end, 0.0);
            Some(Self {
                constraint: moved.unwrap_or_else(|| self.constraint.clone()),
                slack: self.slack - margin,
                position: orbit.as_ref().map(|orbit| orbit[end]),
                ..self.clone()
            })
        };
        (1..=intervals).map_while(at).collect()
    }

    /// By how much deviations may raise `g` within a step, at a part of it from 0 to 1.
    pub(crate) fn spread_at(&self, step: usize, part: f64) -> f64 {
        let [from, to] = [step, step + 1].map(|at| self.spread.get(at).copied().unwrap_or(0.0));
        if part == 0.0 {
            from
        } else {
            from + part * (to - from)
        }
    }

    /// A state of the transfer as the constraint sees it.
    fn seen(&self, state: &BodyState) -> BodyState {
        let seen = self.units.state(state);
        BodyState {
            position: self.position.unwrap_or(seen.position),
            ..seen
        }
    }

    /// `g` at a time after the start of the transfer, without slack and margins.
    pub(crate) fn value_at(&self, time: f64, state: &BodyState) -> f64 {
        let mut seen = self.units.state(state);
        if self.orbit.is_some() {
            // Along an orbit, motions within steps have positions, whatever takes their place in states.
            seen.position = self.units.length() * state.position;
        }
        let state = seen;
        match self.constraint.at(self.start + time * self.units.time()) {
            Some(moved) => moved.value(&state),
            None => self.constraint.value(&state),
        }
    }

    /// The unit of each group of coordinates; that of a single one twice.
    fn unit(&self) -> [f64; 2] {
        let (length, momentum) = (self.units.length(), self.units.linear_momentum());
        match self.coordinates() {
            Coordinates::Position => [length; 2],
            Coordinates::Pose => [length, 1.0],
            Coordinates::Translation => [length, momentum],
            Coordinates::LinearMomentum => [momentum; 2],
            Coordinates::Attitude => [1.0; 2],
            Coordinates::AngularMomentum => [self.units.angular_momentum(); 2],
        }
    }

    /// A factor of `g` that keeps the scale of `g` meaningful near `state`.
    pub(crate) fn scale(&self, state: &BodyState) -> f64 {
        self.constraint.scale(&self.seen(state))
    }

    /// The displacement of the last group of coordinates that changes `g` by 1, to first order at the boundary.
    pub(crate) fn size(&self) -> f64 {
        let [_, unit] = self.unit();
        self.constraint.size() / unit
    }

    /// `g(s)` minus the slack.
    pub(crate) fn value(&self, state: &BodyState) -> f64 {
        self.constraint.value(&self.seen(state)) - self.slack
    }

    /// The violation that is reported when the inequality has the value `g`.
    pub(crate) fn excess(&self, g: f64) -> f64 {
        self.constraint.excess(g + self.slack)
    }

    /// The gradient and the symmetric Hessian of `g` by its first group of coordinates, with variations as in
    /// `DiscreteDynamics::moved`.
    pub(crate) fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let (gradient, hessian) = self.constraint.derivatives(&self.seen(state));
        let [unit, _] = self.unit();
        (unit * gradient, (unit * unit) * hessian)
    }

    /// The derivatives that involve the second group of coordinates.
    pub(crate) fn by_second(&self, state: &BodyState) -> BySecond {
        let found = self.constraint.by_second(&self.seen(state));
        let found = found.unwrap_or(BySecond {
            gradient: Vector3::zeros(),
            hessian: Matrix3::zeros(),
            mixed: Matrix3::zeros(),
        });
        let [unit, second] = self.unit();
        BySecond {
            gradient: second * found.gradient,
            hessian: (second * second) * found.hessian,
            mixed: (unit * second) * found.mixed,
        }
    }
}
