//! Minimum fuel: the weights on the way from a quadratic cost, and the switching structure.

use nalgebra::SMatrix;

use super::attempt::Solver;
use super::class::Class;
use crate::newton::{Iterate, Newton};
use crate::problem::{CommandInequality, Price};
use crate::{Command, Switching, Transfer};

/// The part of the quadratic weight that is left in plans at minimum fuel, so that commands between their limits are unique.
const LAST_SMOOTHNESS: f64 = 1e-6;
/// The same of a body with drag, whose commands stay between their limits on singular arcs. Drag depends on the velocity in the
/// middle of a step, which commands that alternate do not change: this weight alone makes them smooth.
const LAST_SMOOTHNESS_WITH_DRAG: f64 = 1e-4;
/// Distance to zero or a limit, relative to the limit, within which a command is off or at the limit.
const CLOSE: f64 = 1e-3;

/// Part of the greatest possible cost that the barrier takes for the cost of a plan that costs less.
const LEAST: f64 = 1e-3;

/// The first command that costs fuel and has no limit.
pub(super) fn unlimited(transfer: &Transfer) -> Option<usize> {
    let limits = transfer.inequalities.command_limits();
    let mut prices = transfer.actuation.prices().iter();
    prices.find_map(|price| {
        let mut commands = price.commands.clone();
        commands.find(|&command| limits[command].is_infinite())
    })
}

/// The part of the quadratic weight that is left in plans of `transfer` at minimum fuel.
pub(super) fn last_smoothness(transfer: &Transfer) -> f64 {
    match transfer.body.drag() {
        Some(_) => LAST_SMOOTHNESS_WITH_DRAG,
        None => LAST_SMOOTHNESS,
    }
}

/// The state of a command.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Level {
    Off,
    Between,
    AtLimit,
}

impl<C> Solver<'_, C> {
    /// The quadratic weight of the commands, where those with a price have a part of `metric`.
    pub(super) fn weight<const X: usize, const U: usize>(
        &self,
        view: &Transfer,
        metric: SMatrix<f64, U, U>,
    ) -> SMatrix<f64, U, U>
    where
        C: Class<X, U>,
    {
        let actuation = &view.actuation;
        if !actuation.minimizes_fuel() {
            return metric;
        }
        let selection = self.class.selection();
        let factor = |own: usize| {
            let mut commands = 0..actuation.commands();
            let priced = commands.any(|w| selection[(w, own)] != 0.0 && actuation.has_price(w));
            if priced { self.smoothness.sqrt() } else { 1.0 }
        };
        metric.map_with_location(|i, j, weight| weight * (factor(i) * factor(j)))
    }

    /// The size of the cost of fuel: that of an iterate, or a small part of the greatest possible one.
    pub(super) fn fuel<const X: usize, const U: usize>(&self, iterate: &Iterate<X, U>) -> f64
    where
        C: Class<X, U>,
    {
        let (transfer, actuation) = (self.transfer, &self.transfer.actuation);
        if !actuation.minimizes_fuel() {
            return 0.0;
        }
        let commands = iterate.commands.iter().map(|w| self.class.widened(w));
        let spent: f64 = commands.map(|w| actuation.rate(&w)).sum();
        let limits = transfer.inequalities.command_limits();
        let most = actuation.rate(&limits) * transfer.intervals as f64;
        transfer.h * spent.max(LEAST * most)
    }

    /// The switching structure at the iterate of a model, if commands have prices.
    pub(super) fn switching<const X: usize, const U: usize>(
        &self,
        newton: &Newton<X, U>,
    ) -> Option<Switching>
    where
        C: Class<X, U>,
    {
        let (transfer, model) = (self.transfer, &newton.model);
        let prices = transfer.actuation.prices();
        if prices.is_empty() {
            return None;
        }
        let one_sided = transfer.inequalities.one_sided();
        let limits = transfer.inequalities.command_limits();
        let varies = transfer.by_step.as_ref();
        let varies = varies.map(|by_step| by_step.in_intervals(transfer.intervals));
        let mut all = Switching::default();
        for price in prices {
            let mut last = None;
            let mut between = 0;
            for (k, own) in newton.iterate.commands.iter().enumerate() {
                let off = transfer.off(k);
                if price.commands.clone().all(|command| off.contains(command)) {
                    continue;
                }
                let command = self.class.widened(own);
                let limited = varies
                    .as_ref()
                    .map_or(command, |by_step| command / by_step.limits[k]);
                let level = self.level_of(price, limits[price.commands.start], k, &limited);
                let (_, by_command) = model.dynamics[k].backward(&model.inputs, &model.costates[k]);
                let mut primer = -self.class.widened(&by_command);
                if let Some(by_step) = &varies {
                    primer -= transfer.h * by_step.costs[k];
                }
                let primer = match price.direction(&command) {
                    Some(direction) if level != Level::Off => primer.dot(&direction),
                    _ if one_sided[price.commands.start] => primer[price.commands.start],
                    _ => price.magnitude(&primer),
                };
                let switching = primer / (transfer.h * price.price) - 1.0;
                let wrong = match level {
                    Level::Off => switching,
                    Level::Between => switching.abs(),
                    Level::AtLimit => -switching,
                };
                all.contradiction = all.contradiction.max(wrong);
                match level {
                    Level::Between => {
                        between += 1;
                        all.between += 1;
                        all.longest = all.longest.max(between);
                        continue;
                    }
                    Level::AtLimit => all.at_limit += 1,
                    Level::Off => (),
                }
                between = 0;
                if last.is_some_and(|last| last != level) {
                    all.switches += 1;
                }
                last = Some(level);
            }
        }
        Some(all)
    }

    fn level_of(&self, price: &Price, limit: f64, step: usize, command: &Command) -> Level {
        let (transfer, off) = (self.transfer, self.transfer.off(step));
        let inequalities = &transfer.inequalities;
        if price.magnitude(command) <= CLOSE * limit {
            return Level::Off;
        }
        let alone = |row: &CommandInequality| {
            let mut others = row.gradient(command);
            let own = price.commands.clone();
            let mut part = others.rows_mut(own.start, own.len());
            let touches = part.amax() > 0.0;
            part.fill(0.0);
            touches && others.amax() == 0.0
        };
        let mut hard = inequalities
            .command
            .iter()
            .filter(|row| row.price.is_none() && row.restricts(step, transfer.intervals, off));
        let at_limit = hard.any(|row| alone(row) && row.value(command) > -CLOSE);
        if at_limit {
            Level::AtLimit
        } else {
            Level::Between
        }
    }
}
