//! Initial guesses for underactuated bodies, by continuation from a fully actuated body.
//!
//! Two wheels turn a body about the third axis only by combined turns about the other two. At rest the terminal
//! conditions are then not controllable to first order, and no Newton step leads away from rest. With the missing
//! actuators added, the problem is an ordinary one. As the weights of these actuators grow, the plan uses them less and
//! stays away from rest.

use lgvi_lie::{exp, log};
use nalgebra::{Matrix3, Vector3, Vector6};

use super::attempt::{Failure, ROUGH, Solver};
use super::class::Class;
use super::error::PlanError;
use super::progress::Phase;
use super::resolution::resolved;
use crate::newton::{Closeness, Iterate, Newton, Tolerances, guess};
use crate::{Actuation, Transfer};

/// Weights of the missing actuators, in multiples of the cheapest weight of the existing ones.
const WEIGHTS: [f64; 5] = [1.0, 10.0, 100.0, 1e3, 1e4];
/// From this weight on, the body's own actuators must contribute to the plan.
const DEAR: f64 = 100.0;
/// Their share of the cost below which they count as idle.
const IDLE: f64 = 1e-6;
/// Amplitude of a loop (rad).
const ASIDE: f64 = 0.5;
/// Maximum number of Newton steps for each weight.
const PATIENCE: u32 = 25;
/// The part of a column's length that must be orthogonal to the other columns for it to count as independent.
const APART: f64 = 1e-6;

/// The load of a unit command, and its weight.
type Column = (Vector6<f64>, f64);

impl<C> Solver<'_, C> {
    /// Solves at the first resolution with the missing actuators at increasing weights, then without them. Returns
    /// `None` if no actuators are missing or if the commands leave no room for them.
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
            view.actuation = completed(&view.actuation, &own, &missing, weight)?;
            let class = C::of(&view.actuation).ok()?;
            let (class, tolerances) = (std::mem::replace(&mut self.class, class), self.tolerances);
            self.tolerances = Tolerances {
                violation: tolerances.violation.max(ROUGH),
                stationarity: tolerances.stationarity.max(ROUGH),
                iterations: tolerances.iterations.min(PATIENCE),
                ..tolerances
            };
            let mut found = self.at(&view, known, 0.0);
            // A turn about the missing axis alone is stationary at any weight. A path with a loop leads away from it.
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

    /// Returns true if the first `own` commands contribute next to nothing to the cost.
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

    /// The commands of the class.
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

    /// Solves the problem of `view`, from a known iterate or from a smooth path with a loop.
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
        let closeness = match known {
            Some(_) => Closeness::Far,
            None => Closeness::Rough,
        };
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
        Ok(self.level(&problem, iterate, closeness, Phase::Coarse))
    }
}

/// Adds a loop to the attitudes of a path, about axes perpendicular to that of `turn`. The loop has the amplitude
/// `aside` (rad) and is at rest at both ends.
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

/// The sizes of force and moment, as the greatest of any command, or 1 if there is none.
fn sizes(own: &[Column]) -> Vector6<f64> {
    let half = |first: usize| {
        let each = own
            .iter()
            .map(|(column, _)| column.fixed_rows::<3>(first).amax());
        Some(each.fold(0.0, f64::max)).filter(|size| *size > 0.0)
    };
    let [force, moment] = [0, 3].map(|first| half(first).unwrap_or(1.0));
    Vector6::new(force, force, force, moment, moment, moment)
}

/// Directions that the commands do not span, among those of forces if `forces` and of moments if `moments`. In parts of the
/// commands' own sizes of force and moment they are orthonormal, and orthogonal to the commands.
fn missing_directions(own: &[Column], [forces, moments]: [bool; 2]) -> Vec<Vector6<f64>> {
    let sizes = sizes(own);
    let mut basis: Vec<Vector6<f64>> = Vec::new();
    let apart = |basis: &[Vector6<f64>], from: &Vector6<f64>| {
        let mut rest = *from;
        // Each projection is applied twice against rounding errors.
        for direction in basis.iter().chain(basis) {
            rest -= direction * direction.dot(&rest);
        }
        rest
    };
    for (column, _) in own {
        let column = column.component_div(&sizes);
        let rest = apart(&basis, &column);
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
    let missing = basis.split_off(spanned);
    missing
        .iter()
        .map(|direction| direction.component_mul(&sizes))
        .collect()
}

/// The commands together with the missing ones, whose weight is `multiple` times the least weight of a unit load by any
/// command.
fn completed(
    actuation: &Actuation,
    own: &[Column],
    missing: &[Vector6<f64>],
    multiple: f64,
) -> Option<Actuation> {
    let sizes = sizes(own);
    let cheapest = own
        .iter()
        .map(|(column, weight)| weight / column.component_div(&sizes).norm_squared())
        .fold(f64::INFINITY, f64::min);
    let added = missing.iter().map(|column| (*column, multiple * cheapest));
    let columns: Vec<_> = own
        .iter()
        .copied()
        .chain(added)
        .map(|(column, weight)| (column.into(), weight))
        .collect();
    actuation.with_columns(&columns).ok()
}
