//! Terminal conditions that the commands cannot meet independently.

use nalgebra::SVector;

use super::CostToGo;

/// The square of the least relative length that a condition must keep orthogonal to the others to count as independent.
const APART: f64 = 1e-12;
/// Relative residual up to which dependent conditions count as consistent.
const AGREE: f64 = 1e-6;

impl<const X: usize> CostToGo<X> {
    /// The multipliers of dependent conditions. Returns `None` if the conditions that depend on others to first order
    /// are not met along with them, to rounding or within `miss`.
    pub(crate) fn dependent_multipliers(&mut self, miss: f64) -> Option<SVector<f64, X>> {
        let gram = self.gram;
        self.drop_dependent();
        let nu = self.multipliers()?;
        let rest = self.offset + gram * nu;
        let terms = self.offset.abs() + gram.abs() * nu.abs();
        let agree = (0..X).all(|i| rest[i].abs() <= AGREE * terms[i] + miss);
        agree.then_some(nu)
    }

    /// Removes conditions from the Gram matrix M until the remaining ones are independent to first order. The removed
    /// conditions are met with the others or not at all.
    ///
    /// Uses the Cholesky factorization of −M, scaled to a diagonal of 1, with the greatest pivot next.
    fn drop_dependent(&mut self) {
        let scale = self.gram.diagonal().map(|diagonal| {
            if diagonal < 0.0 {
                (-diagonal).sqrt().recip()
            } else {
                0.0
            }
        });
        let mut rest = self.gram;
        for i in 0..X {
            for j in 0..X {
                rest[(i, j)] *= -scale[i] * scale[j];
            }
        }
        let mut left = SVector::<bool, X>::repeat(true);
        for _ in 0..X {
            let mut next = None;
            for i in (0..X).filter(|&i| left[i]) {
                if rest[(i, i)] > next.map_or(APART, |best: usize| rest[(best, best)]) {
                    next = Some(i);
                }
            }
            let Some(next) = next else { break };
            left[next] = false;
            let column = rest.column(next).into_owned();
            rest -= column * column.transpose() / column[next];
        }
        for i in (0..X).filter(|&i| left[i]) {
            self.gram.row_mut(i).fill(0.0);
            self.gram.column_mut(i).fill(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{SMatrix, SVector};

    use super::super::{CostToGo, EndModel};

    /// Four conditions `c = −M ν`, with `c₂ = 2 c₀ + c₁` and one that no command affects.
    #[test]
    fn conditions_that_depend_on_others_follow_them() {
        let by_commands = SMatrix::<f64, 4, 2>::new(1.0, 0.0, 3.0, 1e3, 5.0, 1e3, 0.0, 0.0);
        let gram = by_commands * by_commands.transpose();
        let mut cost = CostToGo::<4>::end(&EndModel {
            hessian: SMatrix::zeros(),
            gradient: SVector::zeros(),
            jacobian: SMatrix::zeros(),
            residual: SVector::zeros(),
        });
        cost.gram = -gram;
        cost.offset = by_commands * SVector::<f64, 2>::new(0.3, -0.7);
        assert!(cost.multipliers().is_none());
        let nu = cost.dependent_multipliers(1e-9).unwrap();
        assert!((gram * nu - cost.offset).norm() < 1e-9 * cost.offset.norm());
        assert_eq!(nu[3], 0.0);
        assert_eq!(nu.iter().filter(|nu| **nu != 0.0).count(), 2);

        cost.gram = -gram;
        cost.offset[3] = 1e-3;
        assert_eq!(cost.dependent_multipliers(1e-9), None);
    }
}
