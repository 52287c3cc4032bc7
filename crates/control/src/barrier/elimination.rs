use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, SMatrix, SVector};

use super::fuel::Fuel;
use super::position::PositionCosts;
use super::row::Row;
use super::set::{Barrier, StateRow, in_interval};
use crate::newton::{BySize, Inequalities, Satisfied};
use crate::riccati::StageModel;

/// The largest part of the distance to 0 or ρ that a multiplier covers in one step, and of its slack that an inequality does.
const BOUNDARY: f64 = 0.995;
/// Length of a step below which satisfied inequalities do not limit it: it would lead nowhere.
const CRAMPED: f64 = 0.07;

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
        for (
            placed,
            StateRow {
                row,
                gradient: slope,
                scale,
            },
        ) in self.states.iter().zip(rows)
        {
            if !placed.plans(interval) {
                continue;
            }
            let inequality = placed.at(interval);
            let penalty = self.schedule.penalty.of(inequality.price);
            row.model(&penalty, *scale * inequality.value(state));
            let (bend, weight) = if self.gives_way {
                (0.0, 0.0)
            } else {
                (curvature * row.multiplier * *scale, row.weight)
            };
            let [first, second] = placed.groups;
            if let Some(offset) = first {
                let (by_group, twice) = inequality.derivatives(state);
                let by_group = *scale * by_group;
                slope[0] = by_group;
                let added = bend * twice + (weight * by_group) * by_group.transpose();
                let mut block = hessian.fixed_view_mut::<3, 3>(offset, offset);
                block += added;
                let mut part = gradient.fixed_rows_mut::<3>(offset);
                part += row.primal * by_group;
            }
            if let Some(offset) = second {
                let by_second = inequality.by_second(state);
                let by_group = *scale * by_second.gradient;
                slope[1] = by_group;
                let mut add = |from: usize, block: Matrix3<f64>| {
                    let mut own = hessian.fixed_view_mut::<3, 3>(from, offset);
                    own += block;
                    if from != offset {
                        let mut mirrored = hessian.fixed_view_mut::<3, 3>(offset, from);
                        mirrored += block.transpose();
                    }
                };
                let along = (weight * by_group).transpose();
                add(offset, bend * by_second.hessian + by_group * along);
                if let Some(from) = first {
                    add(from, bend * by_second.mixed + slope[0] * along);
                }
                let mut part = gradient.fixed_rows_mut::<3>(offset);
                part += row.primal * by_group;
            }
        }
        if let Some(positions) = &mut self.positions {
            positions.add(interval, state, gradient);
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
        let share = self.varying.share(interval);
        let scaled = share * command;
        let all = in_interval(&self.commands, &self.restricts, &self.idle, interval);
        for (inequality, (row, slope)) in all.zip(rows) {
            let penalty = self.schedule.penalty.of(inequality.price);
            row.model(&penalty, inequality.value(&scaled));
            *slope = share * inequality.gradient(&scaled);
            *hessian += (row.multiplier * share * share) * inequality.hessian()
                + (row.weight * *slope) * slope.transpose();
            *gradient += row.primal * *slope;
        }
        if let Some(cost) = self.varying.cost(interval) {
            *gradient += cost;
        }
        if let Some(fuel) = &mut self.fuel {
            fuel.add(
                self.schedule.penalty.beta,
                interval,
                command,
                hessian,
                gradient,
            );
        }
    }

    fn add_joint(
        &mut self,
        interval: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        stage: &mut StageModel<X, U>,
    ) {
        if let Some(wheels) = &mut self.wheels {
            wheels.add(&self.schedule.penalty, interval, state, command, stage);
        }
    }

    fn joint_force(
        &self,
        interval: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
    ) -> Option<(SVector<f64, X>, SVector<f64, U>)> {
        let wheels = self.wheels.as_ref()?;
        Some(wheels.force(&self.schedule.penalty, interval, state, command))
    }

    fn state_force(&self, interval: usize, state: &BodyState) -> SVector<f64, X> {
        let count = self.states.len();
        let rows = &self.state_rows[interval * count..(interval + 1) * count];
        let mut force = SVector::<f64, X>::zeros();
        for (placed, StateRow { row, scale, .. }) in self.states.iter().zip(rows) {
            if placed.plans(interval) {
                let value = scale * placed.at(interval).value(state);
                let penalty = self.schedule.penalty.of(placed.at(interval).price);
                let y = row.multiplier_at(&penalty, value);
                let gradient = placed.gradient(interval, state);
                for (group, by_group) in placed.groups.iter().zip(gradient) {
                    if let Some(offset) = *group {
                        let mut part = force.fixed_rows_mut::<3>(offset);
                        part += (y * scale) * by_group;
                    }
                }
            }
        }
        if let Some(positions) = &self.positions {
            positions.add_force(interval, &mut force);
        }
        force
    }

    fn command_force(&self, interval: usize, command: &SVector<f64, U>) -> SVector<f64, U> {
        let count = self.commands.len();
        let rows = &self.command_rows[interval * count..(interval + 1) * count];
        let mut force = SVector::zeros();
        let share = self.varying.share(interval);
        let scaled = share * command;
        for (inequality, (row, _)) in self.commands_in(interval).zip(rows) {
            let penalty = self.schedule.penalty.of(inequality.price);
            let y = row.multiplier_at(&penalty, inequality.value(&scaled));
            force += (y * share) * inequality.gradient(&scaled);
        }
        if let Some(cost) = self.varying.cost(interval) {
            force += cost;
        }
        if let Some(fuel) = &self.fuel {
            force += fuel.force(self.schedule.penalty.beta, command);
        }
        force
    }

    fn direct(
        &mut self,
        interval: usize,
        start: &SVector<f64, X>,
        z: &SVector<f64, X>,
        v: &SVector<f64, U>,
    ) {
        if interval == 0 {
            self.reach = 1.0;
            self.room = 1.0;
            self.violates = false;
            self.slope = 0.0;
        }
        let penalty = &self.schedule.penalty;
        let mut take = |row: &mut Row, price: Option<f64>, along: f64| {
            row.direct(along);
            self.reach = self.reach.min(row.reach(&penalty.of(price), BOUNDARY));
            if price.is_none() {
                self.room = self.room.min(row.room(penalty, along, BOUNDARY));
                self.violates |= row.value > 0.0;
            }
            self.slope += row.primal * along;
        };
        let count = self.commands.len();
        let rows = &mut self.command_rows[interval * count..(interval + 1) * count];
        let all = in_interval(&self.commands, &self.restricts, &self.idle, interval);
        for (inequality, (row, gradient)) in all.zip(rows) {
            take(row, inequality.price, gradient.dot(v));
        }
        let count = self.states.len();
        let rows = &mut self.state_rows[interval * count..(interval + 1) * count];
        for (placed, StateRow { row, gradient, .. }) in self.states.iter().zip(rows) {
            if placed.plans(interval) {
                let groups = placed.groups.iter().zip(gradient.iter());
                let along = groups.filter_map(|(group, gradient)| {
                    Some(gradient.dot(&z.fixed_rows::<3>((*group)?)))
                });
                take(row, placed.at(interval).price, along.sum());
            }
        }
        if let Some(wheels) = &mut self.wheels {
            wheels.direct(interval, start, v, |row, along| take(row, None, along));
        }
        if let Some(cost) = self.varying.cost(interval) {
            self.slope += cost.dot(v);
        }
        if let Some(fuel) = &mut self.fuel {
            self.slope += fuel.direct(self.schedule.penalty.beta, interval, v);
        }
        if let Some(positions) = &self.positions {
            self.slope += positions.slope(interval, z);
        }
    }

    fn reach(&self) -> f64 {
        self.reach
    }

    fn room(&self) -> f64 {
        if self.within && !self.violates && self.room >= CRAMPED {
            self.room
        } else {
            1.0
        }
    }

    fn merit(
        &self,
        interval: usize,
        [start, state]: [&BodyState; 2],
        command: &SVector<f64, U>,
    ) -> f64 {
        let penalty = &self.schedule.penalty;
        let mut sum = 0.0;
        if let Some(wheels) = &self.wheels {
            sum += wheels.merit(penalty, interval, start, command);
        }
        let scaled = self.varying.share(interval) * command;
        for inequality in self.commands_in(interval) {
            sum += penalty
                .of(inequality.price)
                .value(inequality.value(&scaled));
        }
        if let Some(cost) = self.varying.cost(interval) {
            sum += cost.dot(command);
        }
        if let Some(fuel) = &self.fuel {
            sum += fuel.value(penalty.beta, command);
        }
        let rows = &self.state_rows[interval * self.states.len()..];
        for (placed, StateRow { scale, .. }) in self.states.iter().zip(rows) {
            if placed.plans(interval) {
                let inequality = placed.at(interval);
                let penalty = penalty.of(inequality.price);
                sum += penalty.value(scale * inequality.value(state));
            }
        }
        if let Some(positions) = &self.positions {
            sum += positions.value(interval, state);
        }
        sum
    }

    fn slope(&self) -> f64 {
        self.slope
    }

    fn advance(&mut self, step: f64) {
        self.limits |= self.room() < 1.0;
        for (row, _) in &mut self.command_rows {
            row.multiplier += step * row.change;
        }
        for StateRow { row, .. } in &mut self.state_rows {
            row.multiplier += step * row.change;
        }
        if let Some(wheels) = &mut self.wheels {
            wheels.advance(step);
        }
        if let Some(fuel) = &mut self.fuel {
            fuel.advance(step);
        }
    }

    fn give_way(&mut self, give_way: bool) {
        self.gives_way = give_way;
    }

    fn price(&self, units: &SVector<f64, U>) -> f64 {
        self.fuel.as_ref().map_or(0.0, |fuel| fuel.price(units))
    }

    fn cost(&self) -> f64 {
        self.fuel.as_ref().map_or(0.0, Fuel::cost)
    }

    fn residuals(&self) -> (f64, f64) {
        let now = self.measure();
        (now.violation, self.schedule.complementarity(&now))
    }

    fn priced(&self) -> f64 {
        self.measure().priced
    }

    fn paid(&self) -> f64 {
        let positions = self.positions.as_ref();
        self.measure().paid + positions.map_or(0.0, PositionCosts::paid)
    }

    fn multipliers(&self) -> Vec<Vec<f64>> {
        self.by_row()
    }

    fn by_step_size(&self, commands: &[SVector<f64, U>]) -> f64 {
        let wheels = self.wheels.as_ref();
        wheels.map_or(0.0, |wheels| wheels.by_step_size(commands))
    }

    fn by_step_size_in(
        &mut self,
        interval: usize,
        command: &SVector<f64, U>,
        changes: (&SVector<f64, X>, &SVector<f64, U>),
    ) -> BySize<X, U> {
        match &mut self.wheels {
            Some(wheels) => wheels.by_step_size_in(interval, command, changes),
            None => BySize::default(),
        }
    }

    fn set_step_size(&mut self, h: f64, change: f64) {
        if let Some(wheels) = &mut self.wheels {
            wheels.set_step_size(h, change);
        }
    }

    fn tighten(&mut self, error: f64) -> bool {
        let now = self.measure();
        self.schedule.tighten(error, &now)
    }

    fn satisfied(&self) -> Satisfied {
        self.schedule.satisfied(&self.measure())
    }
}
