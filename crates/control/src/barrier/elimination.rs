use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector};

use super::fuel::Fuel;
use super::row::Row;
use super::set::{Barrier, StateRow};
use crate::newton::{Inequalities, Satisfied};

/// The largest part of the distance to 0 or ρ that a multiplier covers in one step.
const BOUNDARY: f64 = 0.995;

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
            row.model(&self.schedule.penalty, *scale * inequality.value(state));
            let (by_place, twice) = inequality.derivatives(state);
            let by_place = *scale * by_place;
            *slope = by_place;
            let added = (curvature * row.multiplier * *scale) * twice
                + (row.weight * by_place) * by_place.transpose();
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

    fn state_force(&self, interval: usize, state: &BodyState) -> SVector<f64, X> {
        let count = self.states.len();
        let rows = &self.state_rows[interval * count..(interval + 1) * count];
        let mut force = SVector::<f64, X>::zeros();
        for (placed, StateRow { row, scale, .. }) in self.states.iter().zip(rows) {
            if placed.plans(interval) {
                let value = scale * placed.at(interval).value(state);
                let (by_place, _) = placed.at(interval).derivatives(state);
                let y = row.multiplier_at(&self.schedule.penalty, value);
                let mut part = force.fixed_rows_mut::<3>(placed.offset);
                part += (y * scale) * by_place;
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
        if let Some(fuel) = &self.fuel {
            force += fuel.force(self.schedule.penalty.beta, command);
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
        for (placed, StateRow { row, gradient, .. }) in self.states.iter().zip(rows) {
            if placed.plans(interval) {
                take(row, gradient.dot(&z.fixed_rows::<3>(placed.offset)));
            }
        }
        if let Some(fuel) = &mut self.fuel {
            self.slope += fuel.direct(self.schedule.penalty.beta, interval, v);
        }
    }

    fn reach(&self) -> f64 {
        self.reach
    }

    fn merit(&self, interval: usize, state: &BodyState, command: &SVector<f64, U>) -> f64 {
        let penalty = &self.schedule.penalty;
        let mut sum = 0.0;
        for inequality in &self.commands {
            sum += penalty.value(inequality.value(command));
        }
        if let Some(fuel) = &self.fuel {
            sum += fuel.value(penalty.beta, command);
        }
        let rows = &self.state_rows[interval * self.states.len()..];
        for (placed, StateRow { scale, .. }) in self.states.iter().zip(rows) {
            if placed.plans(interval) {
                sum += penalty.value(scale * placed.at(interval).value(state));
            }
        }
        sum
    }

    fn slope(&self) -> f64 {
        self.slope
    }

    fn advance(&mut self, step: f64) {
        for (row, _) in &mut self.command_rows {
            row.multiplier += step * row.change;
        }
        for StateRow { row, .. } in &mut self.state_rows {
            row.multiplier += step * row.change;
        }
        if let Some(fuel) = &mut self.fuel {
            fuel.advance(step);
        }
    }

    fn cost(&self) -> f64 {
        self.fuel.as_ref().map_or(0.0, Fuel::cost)
    }

    fn residuals(&self) -> (f64, f64) {
        let now = self.measure();
        (now.violation, self.schedule.complementarity(&now))
    }

    fn tighten(&mut self, error: f64) -> bool {
        let now = self.measure();
        self.schedule.tighten(error, &now)
    }

    fn satisfied(&self) -> Satisfied {
        self.schedule.satisfied(&self.measure())
    }
}
