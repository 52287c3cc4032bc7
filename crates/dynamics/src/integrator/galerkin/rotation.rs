use std::f64::consts::PI;

use lgvi_lie::{Tangent, compose, hat, log, rotate_back, to_cayley};
use nalgebra::{Matrix3, Vector3};

use super::ChartOrigin;
use super::basis::Basis;
use super::curve::{Curve, Guess, combine};
use super::elimination::Elimination;
use crate::Inertia;
use crate::integrator::StepError;

/// The rotation of one body within a step: the rotation vectors `ξ^1 … ξ^s` of its control points, and the discrete
/// Euler–Lagrange equations for them.
///
/// With the chart's center `C` (`R_0`, or `R_0 exp S(ξ^s)` halfway), `R(τ) = C exp S(ξ(τ))`. In units where h is the
/// unit of time, which multiplies momenta by h and moments by h², `Ω = J_r(ξ) ξ'` and the action is `Σ b_i (½ ΩᵀJΩ −
/// U)`. With `D(ξ, y) = ∂(J_r(ξ) y)/∂ξ`, its derivative with respect to `ξ^κ` at fixed C is `T_κ = Σ_i b_i [l̇_κ
/// J_rᵀΠ_i + l_κ (D(ξ_i, ξ_i')ᵀΠ_i + J_rᵀM_i)]`, which vanishes for inner points.
///
/// A rotation of C together with the whole motion changes only U. With `E = exp S(ξ^s)` and `I = Σ b_i exp S(ξ_i) M_i`,
/// this gives the discrete Noether theorem: `E Π_1 − Π_0 = I` for a center at the start and `E Π_1 − Eᵀ Π_0 = I` for a
/// center halfway. The last control point moves the end, and for a center halfway also the start: `T_s = J_rᵀ(ξ^s) Π_1
/// [+ J_r(ξ^s) Π_0]`. By `J_rᵀ = J_r E`, this equals `T_s = J_r(ξ^s) y` with `y = Π_0 + I [+ Eᵀ Π_0]`, which does not
/// contain `Π_1`.
pub(super) struct RotationPath {
    /// `ξ^κ`.
    pub(super) curve: Curve,
    samples: Vec<Sample>,
    /// `h Σ b_i exp(ξ_i) M_i`, so that `I` is h times it.
    impulse: Vector3<f64>,
    jacobian: Elimination,
    flat: Vec<f64>,
}

/// The motion at a quadrature node.
#[derive(Clone, Copy, Default)]
struct Sample {
    tangent: Tangent,
    /// `exp S(ξ) = CᵀR`.
    rotation: Matrix3<f64>,
    /// `J_r(ξ)`.
    jacobian: Matrix3<f64>,
    /// `ξ'`.
    slope: Vector3<f64>,
    /// `J J_r(ξ) ξ' = h Π`.
    momentum: Vector3<f64>,
    /// `h² M`.
    moment: Vector3<f64>,
}

impl RotationPath {
    pub(super) fn new(basis: &Basis) -> Self {
        Self {
            curve: Curve::new(basis.degree),
            samples: vec![Sample::default(); basis.points],
            impulse: Vector3::zeros(),
            jacobian: Elimination::new(3 * basis.degree),
            flat: vec![0.0; 3 * basis.degree],
        }
    }

    /// Computes the initial guess of `ξ^κ`, with `turn = h Ω_0`.
    pub(super) fn guess(&mut self, basis: &Basis, turn: &Vector3<f64>, guess: Guess) {
        let Curve { points, before, .. } = &mut self.curve;
        let last = points.len() - 1;
        let in_middle = basis.origin == ChartOrigin::Middle;
        // `start` is the start of the new step, in the chart of the given polynomials.
        let (table, start) = match guess {
            Guess::Uniform => {
                let center = if in_middle { 0.5 } else { 0.0 };
                for (xi, control) in points.iter_mut().zip(&basis.controls) {
                    *xi = (control - center) * turn;
                }
                return;
            }
            Guess::Onward => (&basis.onward.chart_value, before[last]),
            Guess::Stretched if in_middle => (&basis.stretched.chart_value, -before[last]),
            Guess::Stretched => (&basis.stretched.chart_value, Vector3::zeros()),
        };
        let mut center = Tangent::at(start).rotation();
        for lambda in (0..=last).rev() {
            let ahead = combine(basis.at(table, lambda), before);
            let xi = log(&center.tr_mul(&Tangent::at(ahead).rotation()));
            points[lambda] = if in_middle && lambda == last {
                center *= Tangent::at(0.5 * xi).rotation();
                0.5 * xi
            } else {
                xi
            };
        }
    }

    /// Computes the motion at the quadrature nodes.
    pub(super) fn sample(&mut self, basis: &Basis, inertia: &Inertia) {
        let points = &self.curve.points;
        for (point, sample) in self.samples.iter_mut().enumerate() {
            let tangent = Tangent::at(combine(basis.at(&basis.chart_value, point), points));
            let slope = combine(basis.at(&basis.chart_slope, point), points);
            let jacobian = tangent.jacobian();
            *sample = Sample {
                tangent,
                rotation: tangent.rotation(),
                jacobian,
                slope,
                momentum: inertia.matrix * (jacobian * slope),
                moment: Vector3::zeros(),
            };
        }
    }

    /// `R_0ᵀ C`.
    pub(super) fn center(&self, basis: &Basis) -> Matrix3<f64> {
        match basis.origin {
            ChartOrigin::Start => Matrix3::identity(),
            ChartOrigin::Middle => Tangent::at(self.curve.points[basis.degree - 1]).rotation(),
        }
    }

    /// `Cᵀ R` at a quadrature node.
    pub(super) fn relative(&self, point: usize) -> &Matrix3<f64> {
        &self.samples[point].rotation
    }

    /// Computes `correction` from the residual of the equations for a step `h` from `Π_0` under moments `M_i`. If
    /// `linearize` is true, renews the Jacobian, which omits the dependence of the moments on the attitude.
    pub(super) fn correct(
        &mut self,
        basis: &Basis,
        inertia: &Inertia,
        momentum: &Vector3<f64>,
        h: f64,
        moment: impl Fn(usize) -> Vector3<f64>,
        linearize: bool,
    ) {
        let residual = &mut self.curve.correction;
        residual.fill(Vector3::zeros());
        self.impulse.fill(0.0);
        for (point, sample) in self.samples.iter_mut().enumerate() {
            let weight = basis.weights[point];
            let moment = moment(point);
            sample.moment = h * h * moment;
            self.impulse += (h * weight) * (sample.rotation * moment);
            let Sample {
                tangent,
                slope,
                momentum,
                ..
            } = sample;
            let by_slope = weight * sample.jacobian.tr_mul(momentum);
            let by_value = weight
                * (tangent.derivative_transposed(slope, momentum)
                    + sample.jacobian.tr_mul(&sample.moment));
            let slopes = basis.at(&basis.chart_slope, point);
            let values = basis.at(&basis.chart_value, point);
            for ((residual, l_slope), l) in residual.iter_mut().zip(slopes).zip(values) {
                *residual += *l_slope * by_slope + *l * by_value;
            }
        }

        let last = basis.degree - 1;
        let end = Tangent::at(self.curve.points[last]);
        let returned = match basis.origin {
            ChartOrigin::Start => Vector3::zeros(),
            ChartOrigin::Middle => end.rotation().tr_mul(&(h * momentum)),
        };
        let y = h * (momentum + self.impulse) + returned;
        self.curve.correction[last] -= end.jacobian() * y;
        if linearize {
            self.linearize(basis, inertia, &end, &y, &returned);
        }

        for (part, residual) in self.flat.chunks_exact_mut(3).zip(&self.curve.correction) {
            part.copy_from_slice(residual.as_slice());
        }
        self.jacobian.solve(&mut self.flat);
        for (part, correction) in self.flat.chunks_exact(3).zip(&mut self.curve.correction) {
            correction.copy_from_slice(part);
        }
    }

    /// Renews the Jacobian of the residual at the samples, given `y` of the last equation and its part `returned = exp
    /// S(−ξ^s) h Π_0`.
    fn linearize(
        &mut self,
        basis: &Basis,
        inertia: &Inertia,
        end: &Tangent,
        y: &Vector3<f64>,
        returned: &Vector3<f64>,
    ) {
        let end_jacobian = end.jacobian();
        let last = basis.degree - 1;
        self.jacobian.entries().fill(0.0);
        for (point, sample) in self.samples.iter().enumerate() {
            let Sample {
                tangent,
                jacobian,
                slope,
                momentum,
                moment,
                ..
            } = sample;
            let weight = basis.weights[point];
            let slopes = basis.at(&basis.chart_slope, point);
            let values = basis.at(&basis.chart_value, point);
            let derivative = tangent.derivative(slope);
            let j_jacobian = inertia.matrix * jacobian;
            // Second derivatives of ½ |J_r(ξ) ξ'|² in the metric J, and of the work of the moment.
            let slope_slope = weight * jacobian.tr_mul(&j_jacobian);
            let slope_value =
                weight * (j_jacobian.tr_mul(&derivative) - tangent.reversed().derivative(momentum));
            let value_slope = slope_value.transpose();
            let value_value = weight
                * (derivative.tr_mul(&(inertia.matrix * derivative))
                    + tangent.second_derivative(slope, momentum)
                    - tangent.reversed().derivative(moment));
            for (kappa, (l_slope, l)) in slopes.iter().zip(values).enumerate() {
                let by_slope = *l_slope * slope_slope + *l * value_slope;
                let by_value = *l_slope * slope_value + *l * value_value;
                for (lambda, (l_slope, l)) in slopes.iter().zip(values).enumerate() {
                    let block = *l_slope * by_slope + *l * by_value;
                    self.jacobian.add_block(kappa, lambda, &block);
                }
            }
            // The impulse in y also depends on ξ: δ(exp S(ξ) M) = −exp S(ξ) S(M) J_r δξ.
            let impulse = weight * (sample.rotation * hat(moment) * jacobian);
            let impulse = end_jacobian * impulse;
            for (lambda, l) in values.iter().enumerate() {
                self.jacobian.add_block(last, lambda, &(*l * impulse));
            }
        }
        let block = end.derivative(y) + end_jacobian * hat(returned) * end_jacobian;
        self.jacobian.add_block(last, last, &-block);
        self.jacobian.factor();
    }

    /// Checks that the body rotates by less than π, the range of the chart.
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

    /// `R_1` and `Π_1`, by rotations that preserve length and orthogonality.
    pub(super) fn end(
        &self,
        basis: &Basis,
        attitude: &Matrix3<f64>,
        momentum: &Vector3<f64>,
    ) -> (Matrix3<f64>, Vector3<f64>) {
        let f = to_cayley(&self.curve.points[basis.degree - 1]);
        match basis.origin {
            ChartOrigin::Start => (
                compose(attitude, &f),
                rotate_back(&f, &(momentum + self.impulse)),
            ),
            ChartOrigin::Middle => {
                let middle = rotate_back(&f, momentum) + self.impulse;
                (
                    compose(&compose(attitude, &f), &f),
                    rotate_back(&f, &middle),
                )
            }
        }
    }
}
