//! From a body with actuators for all directions to one with fewer.
//!
//! Two wheels turn a body about the third axis only by way of the others: at rest the conditions are not controllable at
//! first order, and no Newton step leads away. With the missing actuators added the plan is an ordinary one; as they grow
//! dear it comes to do without them, and keeps away from rest.

use lgvi_lie::{exp, log};
use nalgebra::{Matrix3, Vector3, Vector6};

use super::attempt::{Failure, ROUGH, Solver};
use super::class::Class;
use super::error::PlanError;
use super::progress::Phase;
use super::resolution::resolved;
use crate::newton::{Iterate, Newton, Tolerances, guess};
use crate::{Actuation, Transfer};

/// Weights of the missing actuators, in multiples of the cheapest of those there are.
const WEIGHTS: [f64; 5] = [1.0, 10.0, 100.0, 1e3, 1e4];
/// From this weight on own commands are to do something.
const DEAR: f64 = 100.0;
/// Their share of the cost that counts as nothing.
const IDLE: f64 = 1e-6;
/// How far a loop goes aside (rad).
const ASIDE: f64 = 0.5;
/// Newton steps at most at each of them.
const PATIENCE: u32 = 25;
/// What a direction keeps at least of its length beside others to count as missing.
const APART: f64 = 1e-6;

/// Load of a unit command, and weight.
type Column = (Vector6<f64>, f64);

impl<C> Solver<'_, C> {
    /// At the first resolution, with the missing actuators at a weight that grows and then without them; `None` where
    /// none are missing or the commands leave no place for them.
    pub(super) fn assisted<const X: usize, const U: usize>(
        &mut self,
    ) -> Option<Result<Result<Newton<X, U>, Failure<X, U>>, PlanError>>
    where
        C: Class<X, U>,
    {
        let own = self.own_columns();
        let terminal = &self.transfer.terminal;
        let free = [&terminal.translation, &terminal.rotation].map(|half| half.is_free());
        let wanted = [0, 1].map(|half| C::OFFSETS[half].is_some() && !free[half]);
        let missing = missing_directions(&own, wanted);
        if missing.is_empty() || own.len() + missing.len() > U {
            return None;
        }
        let mut view = resolved(self.transfer, self.first_intervals());
        let mut known: Option<Iterate<X, U>> = None;
        for weight in WEIGHTS {
            view.actuation = completed(&own, &missing, weight)?;
            let class = C::of(&view.actuation).ok()?;
            let (class, tolerances) = (std::mem::replace(&mut self.class, class), self.tolerances);
            self.tolerances = Tolerances {
                violation: tolerances.violation.max(ROUGH),
                stationarity: tolerances.stationarity.max(ROUGH),
                iterations: tolerances.iterations.min(PATIENCE),
                ..tolerances
            };
            let mut found = self.at(&view, known, 0.0);
            // A turn about the missing axis alone is stationary at any weight: to leave it takes a path aside.
            if weight >= DEAR
                && matches!(&found, Ok(Ok(newton)) if self.is_idle(&view, newton, own.len()))
            {
                found = self.at(&view, None, ASIDE);
            }
            (self.class, self.tolerances) = (class, tolerances);
            match found {
                Ok(Ok(newton)) => known = Some(newton.iterate),
                failure => return Some(failure),
            }
        }
        view.actuation = self.transfer.actuation.clone();
        if let Some(iterate) = &mut known {
            for command in &mut iterate.commands {
                command.rows_mut(own.len(), U - own.len()).fill(0.0);
            }
        }
        Some(self.at(&view, known, 0.0))
    }

    /// Whether the first commands, `own` in number, are next to none of the cost.
    fn is_idle<const X: usize, const U: usize>(
        &self,
        view: &Transfer,
        newton: &Newton<X, U>,
        own: usize,
    ) -> bool
    where
        C: Class<X, U>,
    {
        let weight = self.class.weight(view).diagonal();
        let [mut first, mut all] = [0.0; 2];
        for command in &newton.iterate.commands {
            let costs = command.component_mul(command).component_mul(&weight);
            first += costs.rows(0, own).sum();
            all += costs.sum();
        }
        first < IDLE * all
    }

    /// The class's commands.
    fn own_columns<const X: usize, const U: usize>(&self) -> Vec<Column>
    where
        C: Class<X, U>,
    {
        let matrix = self.transfer.actuation.matrix() * self.class.selection();
        let weight = self.class.weight(self.transfer).diagonal();
        let columns = matrix.column_iter().zip(weight.iter());
        columns
            .map(|(column, weight)| (column.into_owned(), *weight))
            .filter(|(column, _)| *column != Vector6::zeros())
            .collect()
    }

    /// The plan of a view, from that of another or from a smooth path that loops.
    fn at<const X: usize, const U: usize>(
        &mut self,
        view: &Transfer,
        known: Option<Iterate<X, U>>,
        aside: f64,
    ) -> Result<Result<Newton<X, U>, Failure<X, U>>, PlanError>
    where
        C: Class<X, U>,
    {
        let steps = self.class.steps(view)?;
        let problem = self.problem(view, &steps);
        let rough = known.is_none();
        let iterate = match known {
            Some(iterate) => iterate,
            None => {
                let goal = self.goal();
                let duration = view.h * view.intervals as f64;
                let mut path = guess::hermite(
                    &view.body,
                    duration,
                    view.intervals,
                    &view.initial,
                    &goal,
                    0.0,
                );
                let turn = log(&view.initial.attitude.tr_mul(&goal.attitude));
                looped(&mut path, &turn, aside);
                guess::along(&problem, &view.body, &path, &goal)
                    .map_err(|(step, source)| PlanError::Dynamics { step, source })?
            }
        };
        Ok(self.level(&problem, iterate, rough, Phase::Coarse))
    }
}

/// Makes a path go round its own, across the axis of `turn`, as far as `aside` (rad) and from rest to rest.
fn looped(path: &mut [(Vector3<f64>, Matrix3<f64>)], turn: &Vector3<f64>, aside: f64) {
    let Some(axis) = turn.try_normalize(f64::MIN_POSITIVE) else {
        return;
    };
    let first = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    let second = axis.cross(&first);
    let share = std::f64::consts::PI / path.len().saturating_sub(1).max(1) as f64;
    for (k, (_, attitude)) in path.iter_mut().enumerate() {
        let (sine, cosine) = libm::sincos(k as f64 * share);
        let round = (cosine * cosine - sine * sine) * first + 2.0 * sine * cosine * second;
        *attitude *= exp(&(aside * sine * sine * round));
    }
}

/// Directions of forces and of moments, if of these, that commands do not span: orthonormal, and orthogonal to theirs.
fn missing_directions(own: &[Column], [forces, moments]: [bool; 2]) -> Vec<Vector6<f64>> {
    let mut basis: Vec<Vector6<f64>> = Vec::new();
    let apart = |basis: &[Vector6<f64>], from: &Vector6<f64>| {
        let mut rest = *from;
        // Once more against rounding.
        for direction in basis.iter().chain(basis) {
            rest -= direction * direction.dot(&rest);
        }
        rest
    };
    for (column, _) in own {
        let rest = apart(&basis, column);
        if rest.norm() > APART * column.norm() {
            basis.push(rest.normalize());
        }
    }
    let spanned = basis.len();
    let wanted = [
        0..if forces { 3 } else { 0 },
        3..if moments { 6 } else { 3 },
    ];
    let axes: Vec<_> = wanted.into_iter().flatten().collect();
    while basis.len() < axes.len() {
        let rests = axes
            .iter()
            .map(|&axis| apart(&basis, &Vector6::ith(axis, 1.0)));
        let Some(most) = rests.max_by(|a, b| a.norm().total_cmp(&b.norm())) else {
            break;
        };
        basis.push(most.normalize());
    }
    basis.split_off(spanned)
}

/// Commands and, at a multiple of the least weight of a unit load by any of them, missing ones.
fn completed(own: &[Column], missing: &[Vector6<f64>], multiple: f64) -> Option<Actuation> {
    let cheapest = own
        .iter()
        .map(|(column, weight)| weight / column.norm_squared())
        .fold(f64::INFINITY, f64::min);
    let added = missing.iter().map(|column| (*column, multiple * cheapest));
    let columns: Vec<_> = own
        .iter()
        .copied()
        .chain(added)
        .map(|(column, weight)| (column.into(), weight))
        .collect();
    Actuation::actuators(&columns).ok()
}
