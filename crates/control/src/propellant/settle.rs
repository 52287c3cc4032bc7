//! The masses and costs that belong to their own plan, by Anderson's acceleration of a fixed point.

use nalgebra::{DMatrix, DVector, SVD};

/// Part of the way to the result of an iteration that is gone where nothing is known of others.
const PART: f64 = 0.8;
/// Largest number of earlier iterations that count.
const DEPTH: usize = 5;
/// Relative size of singular values that count.
const RANK: f64 = 1e-8;
/// Iteration limit of the singular value decomposition; a finite matrix takes a few dozen.
const MOST: usize = 1000;

/// An iteration `x ← T(x)`, accelerated by the differences of the last results (D. G. Anderson, *Iterative procedures for
/// nonlinear integral equations*, J. ACM 12, 1965).
#[derive(Default)]
pub(super) struct Settling {
    /// `x` and `T(x) − x`, the last one last.
    known: Vec<[DVector<f64>; 2]>,
}

impl Settling {
    /// The next `x` from the present one and its result.
    pub(super) fn next(&mut self, x: &DVector<f64>, result: &DVector<f64>) -> DVector<f64> {
        let residual = result - x;
        if self.known.len() > DEPTH {
            self.known.remove(0);
        }
        let [mut next, mut rest] = [x.clone(), residual.clone()];
        if !self.known.is_empty() {
            let columns = |which: usize, now: &DVector<f64>| {
                let all: Vec<_> = self.known.iter().map(|known| now - &known[which]).collect();
                DMatrix::from_columns(&all)
            };
            let [moves, changes] = [columns(0, x), columns(1, &residual)];
            let values = SVD::try_new(changes.clone(), true, true, 5.0 * f64::EPSILON, MOST);
            let solved = values.and_then(|values| {
                let least = RANK * values.singular_values.max();
                values.solve(&residual, least).ok()
            });
            if let Some(factors) = solved {
                next -= moves * &factors;
                rest -= changes * factors;
            }
        }
        self.known.push([x.clone(), residual]);
        next + PART * rest
    }
}
