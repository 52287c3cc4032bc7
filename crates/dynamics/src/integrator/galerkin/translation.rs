use nalgebra::Vector3;

use super::basis::Basis;
use super::curve::{Curve, Guess, combine};

/// The motion of one body's center of mass within a step: the displacements `x^κ − x_0` of its control points.
/// Stationarity of the action gives them explicitly in terms of the forces, see [`Basis::response`].
pub(super) struct TranslationPath {
    /// `x^κ − x_0`.
    pub(super) curve: Curve,
}

impl TranslationPath {
    pub(super) fn new(basis: &Basis) -> Self {
        Self {
            curve: Curve::new(basis.degree),
        }
    }

    /// Computes the initial guess of the displacements, with `way = h ẋ_0`.
    pub(super) fn guess(&mut self, basis: &Basis, way: &Vector3<f64>, guess: Guess) {
        let Curve { points, before, .. } = &mut self.curve;
        let zero = Vector3::zeros();
        let (table, from) = match guess {
            Guess::Uniform => {
                for (point, control) in points.iter_mut().zip(&basis.controls) {
                    *point = *control * way;
                }
                return;
            }
            Guess::Onward => (&basis.onward.value, before.last().unwrap_or(&zero)),
            Guess::Stretched => (&basis.stretched.value, &zero),
        };
        for (kappa, point) in points.iter_mut().enumerate() {
            *point = combine(basis.at(table, kappa), before) - from;
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
