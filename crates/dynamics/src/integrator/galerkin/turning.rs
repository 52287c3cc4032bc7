use std::f64::consts::PI;

use lgvi_lie::{compose, hat, log, rotate_back, to_cayley};
use nalgebra::{Matrix3, Vector3};

use super::ChartOrigin;
use super::basis::Basis;
use super::curve::{Curve, Guess, combine};
use super::elimination::Elimination;
use super::tangent::Tangent;
use crate::Inertia;
use crate::integrator::StepError;

/// One turning body within a step: the rotation vectors `ξ^1 … ξ^s` of its control points and the discrete
/// Euler–Lagrange equations for them.
///
/// With the chart's centre `C` (`R_0`, or `R_0 exp ξ^s` half-way), `R(τ) = C exp S(ξ(τ))`. In the unit of time h, `Ω` is
/// `J_r(ξ) ξ'` and the action `Σ b_i (½ ΩᵀJΩ − h² U)`. Its derivative by `ξ^κ` at fixed C is
/// `T_κ = Σ_i b_i [l̇_κ J_rᵀΠ_i + l_κ (D(ξ, ξ')ᵀΠ_i + h² J_rᵀM_i)]`, `D(ξ, y) = ∂(J_r y)/∂ξ`; inner ones vanish. Turning C
/// and all that hangs on it changes U only: with `E = exp S(ξ^s)` and the impulse `I = h² Σ b_i exp(ξ_i) M_i`, that gives
/// `E Π_1 = h Π_0 + I` (centre at the start) or `E Π_1 = Eᵀ h Π_0 + I` (in the middle), the discrete Noether theorem. It
/// turns `T_s = J_rᵀ(ξ^s) Π_1 [+ J_r(ξ^s) h Π_0]` into `T_s = J_r(ξ^s) y`, `y = E Π_1 [+ h Π_0]`.
pub(super) struct Turning {
    /// `ξ^κ`
    pub(super) curve: Curve,
    samples: Vec<Sample>,
    /// `Σ b_i exp(ξ_i) M_i`
    impulse: Vector3<f64>,
    jacobian: Elimination,
    flat: Vec<f64>,
}

/// The motion at a quadrature node.
#[derive(Clone, Copy, Default)]
struct Sample {
    tangent: Tangent,
    /// `ξ'`
    slope: Vector3<f64>,
}

impl Turning {
    pub(super) fn new(basis: &Basis) -> Self {
        Self {
            curve: Curve::new(basis.degree),
            samples: vec![Sample::default(); basis.points],
            impulse: Vector3::zeros(),
            jacobian: Elimination::new(3 * basis.degree),
            flat: vec![0.0; 3 * basis.degree],
        }
    }

    /// Guesses `ξ^κ`; `turn = h Ω_0`.
    pub(super) fn guess(&mut self, basis: &Basis, turn: &Vector3<f64>, guess: Guess) {
        let Curve { points, before, .. } = &mut self.curve;
        let last = points.len() - 1;
        let in_middle = basis.origin == ChartOrigin::Middle;
        // Where the guessed step starts, in the chart of the polynomials given.
        let (table, start) = match guess {
            Guess::Uniform => {
                let centre = if in_middle { 0.5 } else { 0.0 };
                for (xi, control) in points.iter_mut().zip(&basis.controls) {
                    *xi = (control - centre) * turn;
                }
                return;
            }
            Guess::Onward => (&basis.onward.chart_value, before[last]),
            Guess::Stretched if in_middle => (&basis.stretched.chart_value, -before[last]),
            Guess::Stretched => (&basis.stretched.chart_value, Vector3::zeros()),
        };
        let mut centre = Tangent::at(start).rotation();
        for lambda in (0..=last).rev() {
            let ahead = combine(basis.at(table, lambda), before);
            let xi = log(&centre.tr_mul(&Tangent::at(ahead).rotation()));
            points[lambda] = if in_middle && lambda == last {
                centre *= Tangent::at(0.5 * xi).rotation();
                0.5 * xi
            } else {
                xi
            };
        }
    }

    /// Computes the motion at the quadrature nodes.
    pub(super) fn sample(&mut self, basis: &Basis) {
        for (point, sample) in self.samples.iter_mut().enumerate() {
            let xi = combine(basis.at(&basis.chart_value, point), &self.curve.points);
            *sample = Sample {
                tangent: Tangent::at(xi),
                slope: combine(basis.at(&basis.chart_slope, point), &self.curve.points),
            };
        }
    }

    /// `R_0ᵀ C`
    pub(super) fn centre(&self, basis: &Basis) -> Matrix3<f64> {
        match basis.origin {
            ChartOrigin::Start => Matrix3::identity(),
            ChartOrigin::Middle => Tangent::at(self.curve.points[basis.degree - 1]).rotation(),
        }
    }

    /// `Cᵀ R` at a quadrature node.
    pub(super) fn relative(&self, point: usize) -> Matrix3<f64> {
        self.samples[point].tangent.rotation()
    }

    /// Sets `correction` from the equations' residual for a step `h` from `Π_0` under moments `M_i`; `linearise` renews
    /// the Jacobian, which leaves out the moments' dependence on the attitude.
    pub(super) fn correct(
        &mut self,
        basis: &Basis,
        inertia: &Inertia,
        momentum: &Vector3<f64>,
        h: f64,
        moment: impl Fn(usize) -> Vector3<f64>,
        linearise: bool,
    ) {
        let s = basis.degree;
        if linearise {
            self.jacobian.entries().fill(0.0);
        }
        self.curve.correction.fill(Vector3::zeros());
        self.impulse.fill(0.0);
        let end = Tangent::at(self.curve.points[s - 1]).jacobian();
        for point in 0..basis.points {
            let Sample { tangent, slope } = self.samples[point];
            let weight = basis.weights[point];
            let values = basis.at(&basis.chart_value, point);
            let slopes = basis.at(&basis.chart_slope, point);
            let jacobian = tangent.jacobian();
            let pi = inertia.matrix * (jacobian * slope);
            let moment = moment(point);
            self.impulse += weight * (tangent.rotation() * moment);
            let by_slope = weight * jacobian.tr_mul(&pi);
            let by_value = weight
                * (tangent.derivative_transposed(&slope, &pi) + (h * h) * jacobian.tr_mul(&moment));
            for kappa in 0..s {
                self.curve.correction[kappa] += slopes[kappa] * by_slope + values[kappa] * by_value;
            }
            if linearise {
                let turned = inertia.matrix * jacobian;
                let derivative = tangent.derivative(&slope);
                let slope_slope = weight * jacobian.tr_mul(&turned);
                let slope_value =
                    weight * (turned.tr_mul(&derivative) - tangent.reversed().derivative(&pi));
                let value_slope = slope_value.transpose();
                let value_value = weight
                    * (derivative.tr_mul(&(inertia.matrix * derivative))
                        + tangent.second_derivative(&slope, &pi)
                        - (h * h) * tangent.reversed().derivative(&moment));
                let impulse = weight * (tangent.rotation() * hat(&moment) * jacobian);
                for kappa in 0..s {
                    let row_slope = slopes[kappa] * slope_slope + values[kappa] * value_slope;
                    let row_value = slopes[kappa] * slope_value + values[kappa] * value_value;
                    for lambda in 0..s {
                        let block = slopes[lambda] * row_slope + values[lambda] * row_value;
                        self.add_block(kappa, lambda, &block);
                    }
                }
                for (lambda, value) in values.iter().enumerate() {
                    let block = (h * h * value) * (end * impulse);
                    self.add_block(s - 1, lambda, &block);
                }
            }
        }
        self.close(
            basis,
            &(h * (momentum + h * self.impulse)),
            &(h * momentum),
            linearise,
        );
        for (part, correction) in self.flat.chunks_exact_mut(3).zip(&self.curve.correction) {
            part.copy_from_slice(correction.as_slice());
        }
        self.jacobian.solve(&mut self.flat);
        for (part, correction) in self.flat.chunks_exact(3).zip(&mut self.curve.correction) {
            correction.copy_from_slice(part);
        }
    }

    /// The right-hand side `J_r(ξ^s) y` of the last equation, from `h Π_0 + I` and `h Π_0`.
    fn close(
        &mut self,
        basis: &Basis,
        kicked: &Vector3<f64>,
        momentum: &Vector3<f64>,
        linearise: bool,
    ) {
        let last = basis.degree - 1;
        let end = Tangent::at(self.curve.points[last]);
        let mut y = *kicked;
        let mut returned = Vector3::zeros();
        if basis.origin == ChartOrigin::Middle {
            returned = end.rotation().tr_mul(momentum);
            y += returned;
        }
        let jacobian = end.jacobian();
        self.curve.correction[last] -= jacobian * y;
        if linearise {
            let block = end.derivative(&y) + jacobian * hat(&returned) * jacobian;
            self.add_block(last, last, &-block);
            self.jacobian.factor();
        }
    }

    fn add_block(&mut self, kappa: usize, lambda: usize, block: &Matrix3<f64>) {
        let width = 3 * self.curve.points.len();
        let entries = self.jacobian.entries();
        for row in 0..3 {
            for column in 0..3 {
                entries[(3 * kappa + row) * width + 3 * lambda + column] += block[(row, column)];
            }
        }
    }

    /// Whether the body turns by less than π, as far as the chart reaches.
    pub(super) fn check(&self, basis: &Basis, body: usize) -> Result<(), StepError> {
        let end = self.curve.points[basis.degree - 1].norm();
        let turn = match basis.origin {
            ChartOrigin::Start => end,
            ChartOrigin::Middle => 2.0 * end,
        };
        if turn < PI {
            Ok(())
        } else {
            Err(StepError::TurnsTooFar { body, turn })
        }
    }

    /// `R_1` and `Π_1`: rotations that neither lose length nor orthogonality.
    pub(super) fn end(
        &self,
        basis: &Basis,
        attitude: &Matrix3<f64>,
        momentum: &Vector3<f64>,
        h: f64,
    ) -> (Matrix3<f64>, Vector3<f64>) {
        let f = to_cayley(&self.curve.points[basis.degree - 1]);
        let impulse = h * self.impulse;
        match basis.origin {
            ChartOrigin::Start => (
                compose(attitude, &f),
                rotate_back(&f, &(momentum + impulse)),
            ),
            ChartOrigin::Middle => {
                let middle = rotate_back(&f, momentum) + impulse;
                (
                    compose(&compose(attitude, &f), &f),
                    rotate_back(&f, &middle),
                )
            }
        }
    }
}
