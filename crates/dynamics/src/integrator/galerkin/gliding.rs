use nalgebra::Vector3;

use super::basis::Basis;
use super::curve::{Curve, combine};

/// One body's centre of mass within a step: the displacements `x^κ − x_0` of its control points, which stationarity of
/// the action gives explicitly in the forces, see [`Basis::response`].
pub(super) struct Gliding {
    /// `x^κ − x_0`
    pub(super) curve: Curve,
}

impl Gliding {
    pub(super) fn new(basis: &Basis) -> Self {
        Self {
            curve: Curve::new(basis.degree),
        }
    }

    /// Guesses the displacements by the last step's polynomial carried on, or by constant velocity `way/h`.
    pub(super) fn predict(&mut self, basis: &Basis, way: &Vector3<f64>, carry_on: bool) {
        let last = self.curve.last.get().filter(|_| carry_on);
        for (kappa, point) in self.curve.points.iter_mut().enumerate() {
            *point = match last {
                Some(last) => {
                    combine(basis.at(&basis.extrapolation, kappa), last) - last[basis.degree - 1]
                }
                None => basis.controls[kappa] * way,
            };
        }
    }

    /// The displacement at a quadrature node.
    pub(super) fn at(&self, basis: &Basis, point: usize) -> Vector3<f64> {
        combine(basis.at(&basis.value, point), &self.curve.points)
    }

    /// Sets `correction` from `way = h ẋ_0` and the forces times `h²/m`.
    pub(super) fn correct(
        &mut self,
        basis: &Basis,
        way: &Vector3<f64>,
        force: impl Fn(usize) -> Vector3<f64>,
    ) {
        let unknowns = self.curve.points.iter().zip(&basis.controls);
        for (correction, (displacement, control)) in self.curve.correction.iter_mut().zip(unknowns)
        {
            *correction = displacement - *control * way;
        }
        for point in 0..basis.points {
            let force = force(point);
            let responses = basis.at(&basis.response, point);
            for (correction, response) in self.curve.correction.iter_mut().zip(responses) {
                *correction -= *response * force;
            }
        }
    }
}
