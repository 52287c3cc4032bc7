use nalgebra::{SMatrix, SVector, Vector3};

use super::schedule::Schedule;
use crate::problem::{InequalitySet, Price};
use crate::{MAX_COMMANDS, Transfer};

/// The cost of fuel of each interval: `Σ h p |M w|`.
///
/// A quadratic cost that is as large at twice the limit l of the commands, `½ h (p/l) |M w|²`, is added and decreases with β from
/// its first value β₀, so that the solution leads from smooth commands to those that switch (Bertrand and Epenoy, *New smoothing
/// techniques for solving bang-bang optimal control problems*, 2002).
///
/// The norm is smoothed to `r = √(|v|² + δ²)`, where `v = M w` and `δ = β/(h p)`, so that the smoothing costs at most β. Its
/// curvature near zero is that of a kink, along which Newton's method would stray. So the direction `d = v/r` is an unknown of
/// its own with the equation `d r = v`, and is eliminated (Chan, Golub and Mulet, *A nonlinear primal-dual method for total
/// variation-based image restoration*, 1999). The Hessian by v is `(h p/r) (I − ½ (d vᵀ + v dᵀ)/r)`, positive semidefinite for
/// `|d| ≤ 1`. A command that must not be negative costs `h p w`, without a kink.
#[derive(Clone, Debug)]
pub(super) struct Fuel<const U: usize> {
    terms: Vec<Term<U>>,
    /// A row for each interval and term.
    rows: Vec<Row>,
}

/// The price of some of the commands.
#[derive(Clone, Debug)]
struct Term<const U: usize> {
    /// `M`
    matrix: SMatrix<f64, 3, U>,
    /// `h p`
    price: f64,
    /// `h p/l`
    weight: f64,
    /// `h p/(l β₀)`
    curvature: f64,
    /// True of one command that must not be negative.
    one_sided: bool,
}

/// A term at one interval: its unknown, and its contributions to the model of the current iterate.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    /// `d`
    direction: Vector3<f64>,
    change: Vector3<f64>,
    /// `v`
    v: Vector3<f64>,
    /// `r`
    smoothed: f64,
}

impl<const U: usize> Fuel<U> {
    /// The prices of the commands that `selection` makes of the `U` planned ones.
    pub(super) fn new(
        transfer: &Transfer,
        set: &InequalitySet,
        selection: &SMatrix<f64, MAX_COMMANDS, U>,
        schedule: &Schedule,
    ) -> Self {
        let (h, actuation) = (transfer.h, &transfer.actuation);
        let one_sided = set.one_sided();
        let term = |price: &Price| {
            let (first, count) = (price.commands.start, price.commands.len());
            let mut matrix = SMatrix::<f64, 3, U>::zeros();
            let rows = selection.rows(first, count);
            matrix.rows_mut(0, count).copy_from(&rows);
            let weight = h * actuation.weight()[(first, first)];
            Term {
                matrix,
                price: h * price.price,
                weight,
                curvature: weight / schedule.penalty.beta,
                one_sided: count == 1 && one_sided[first],
            }
        };
        let terms: Vec<_> = actuation.prices().iter().map(term).collect();
        Self {
            rows: vec![Row::default(); terms.len() * transfer.intervals],
            terms,
        }
    }

    /// Makes this the first β.
    pub(super) fn smooth_from(&mut self, beta: f64) {
        for term in &mut self.terms {
            term.curvature = term.weight / beta;
        }
    }

    /// The least cost of a command that is at its limit for a step, `h p l`.
    pub(super) fn least_at_limit(&self) -> f64 {
        let costs = self
            .terms
            .iter()
            .map(|term| term.price * term.price / term.weight);
        costs.fold(f64::INFINITY, f64::min)
    }

    /// Sets the directions to those of the commands.
    pub(super) fn start(&mut self, beta: f64, commands: &[SVector<f64, U>]) {
        let count = self.terms.len();
        for (at, row) in self.rows.iter_mut().enumerate() {
            let (v, smoothed) = self.terms[at % count].smoothed(beta, &commands[at / count]);
            row.direction = v / smoothed;
        }
    }

    /// The largest `h p` in these units of gradients by commands.
    pub(super) fn price(&self, units: &SVector<f64, U>) -> f64 {
        let price = |term: &Term<U>| {
            let rows = term.matrix.row_iter();
            let sizes = rows.map(|row| row.transpose().component_mul(units).amax());
            term.price * sizes.fold(0.0, f64::max)
        };
        self.terms.iter().map(price).fold(0.0, f64::max)
    }

    /// `Σ h p |v|` of all intervals at the last iterate.
    pub(super) fn cost(&self) -> f64 {
        let prices = self.terms.iter().map(|term| term.price).cycle();
        let rows = prices.zip(&self.rows);
        rows.map(|(price, row)| price * row.v.norm()).sum()
    }

    /// Adds the contributions of an interval to the Hessian and the gradient.
    pub(super) fn add(
        &mut self,
        beta: f64,
        interval: usize,
        command: &SVector<f64, U>,
        hessian: &mut SMatrix<f64, U, U>,
        gradient: &mut SVector<f64, U>,
    ) {
        let count = self.terms.len();
        let rows = &mut self.rows[interval * count..(interval + 1) * count];
        for (term, row) in self.terms.iter().zip(rows) {
            (row.v, row.smoothed) = term.smoothed(beta, command);
            *gradient += term.gradient(beta, &row.v, row.smoothed);
            let mut by_v = SMatrix::<f64, 3, 3>::from_diagonal_element(term.quadratic(beta));
            if !term.one_sided {
                by_v += term.price * row.hessian();
            }
            *hessian += term.matrix.tr_mul(&(by_v * term.matrix));
        }
    }

    /// `∂/∂w` of an interval's cost.
    pub(super) fn force(&self, beta: f64, command: &SVector<f64, U>) -> SVector<f64, U> {
        let mut force = SVector::zeros();
        for term in &self.terms {
            let (v, smoothed) = term.smoothed(beta, command);
            force += term.gradient(beta, &v, smoothed);
        }
        force
    }

    /// An interval's cost.
    pub(super) fn value(&self, beta: f64, command: &SVector<f64, U>) -> f64 {
        let value = |term: &Term<U>| {
            let (v, smoothed) = term.smoothed(beta, command);
            term.price * if term.one_sided { v.x } else { smoothed }
                + 0.5 * term.quadratic(beta) * v.norm_squared()
        };
        self.terms.iter().map(value).sum()
    }

    /// Computes the changes of an interval's directions for the change `by` of its command. Returns the derivative of the cost.
    pub(super) fn direct(&mut self, beta: f64, interval: usize, by: &SVector<f64, U>) -> f64 {
        let count = self.terms.len();
        let rows = &mut self.rows[interval * count..(interval + 1) * count];
        let mut slope = 0.0;
        for (term, row) in self.terms.iter().zip(rows) {
            row.direct(&(term.matrix * by));
            slope += term.gradient(beta, &row.v, row.smoothed).dot(by);
        }
        slope
    }

    /// Moves the directions by a step, within the unit ball.
    pub(super) fn advance(&mut self, step: f64) {
        for row in &mut self.rows {
            row.direction += step * row.change;
            row.direction /= row.direction.norm().max(1.0);
        }
    }
}

impl<const U: usize> Term<U> {
    /// `v` and `r`.
    fn smoothed(&self, beta: f64, command: &SVector<f64, U>) -> (Vector3<f64>, f64) {
        let v = self.matrix * command;
        let delta = beta / self.price;
        (v, (v.norm_squared() + delta * delta).sqrt())
    }

    /// `h p β/(l β₀)`
    fn quadratic(&self, beta: f64) -> f64 {
        self.curvature * beta
    }

    fn gradient(&self, beta: f64, v: &Vector3<f64>, smoothed: f64) -> SVector<f64, U> {
        let by_v = if self.one_sided {
            Vector3::x()
        } else {
            v / smoothed
        };
        self.matrix
            .tr_mul(&(self.price * by_v + self.quadratic(beta) * v))
    }
}

impl Row {
    fn hessian(&self) -> SMatrix<f64, 3, 3> {
        let half = self.direction * self.v.transpose() * (0.5 / self.smoothed);
        (SMatrix::identity() - half - half.transpose()) / self.smoothed
    }

    /// The Newton step of `d r = v` for a change of `v`.
    fn direct(&mut self, by: &Vector3<f64>) {
        let Self {
            direction,
            v,
            smoothed,
            ..
        } = self;
        let stretch = 1.0 + v.dot(by) / (*smoothed * *smoothed);
        self.change = (*v + by) / *smoothed - *direction * stretch;
    }
}
