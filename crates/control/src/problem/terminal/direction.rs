use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::problem::pointing::{Pointing, across};

/// Two conditions that align a body axis `a` with a direction `d`: `φ(d·Ra) (p·Ra)` and `φ(d·Ra) (q·Ra)`, with the
/// triad `d`, `p`, `q` and `φ = θ/sin θ`. Up to a quarter turn about `d`, they are the components perpendicular to `d`
/// of the shortest rotation from `d` to `R a`. Their norm is the angle θ between the two, up to half a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Direction {
    pub(super) axis: Vector3<f64>,
    pub(super) direction: Vector3<f64>,
    plane: [Vector3<f64>; 2],
}

/// Above this cosine, φ is computed from its series in `1 − cos θ`.
const SERIES: f64 = 0.8;

/// Number of terms of the series; each is about a tenth of the one before.
const TERMS: u32 = 18;

/// The sine of the angle that is assumed when an axis points exactly opposite to the direction.
const ANTIPODE: f64 = 1e-8;

impl Direction {
    /// The condition that aligns the body axis `axis` with `direction`, both unit vectors.
    pub(super) fn new(axis: Vector3<f64>, direction: Vector3<f64>) -> Self {
        let plane = across(&direction);
        Self {
            axis,
            direction,
            plane,
        }
    }

    pub(super) fn residual(&self, attitude: &Matrix3<f64>) -> SVector<f64, 2> {
        let [along, p, q] = self.pointings(attitude);
        let [phi, ..] = angle_over_sine(&along, &p, &q);
        SVector::from([phi * p.value, phi * q.value])
    }

    pub(super) fn jacobian(&self, attitude: &Matrix3<f64>) -> SMatrix<f64, 2, 3> {
        let [along, p, q] = self.pointings(attitude);
        let [phi, first, _] = angle_over_sine(&along, &p, &q);
        let row = |across: &Pointing| {
            (phi * across.gradient + first * across.value * along.gradient).transpose()
        };
        SMatrix::<f64, 2, 3>::from_rows(&[row(&p), row(&q)])
    }

    pub(super) fn curvature(&self, attitude: &Matrix3<f64>, nu: &SVector<f64, 2>) -> Matrix3<f64> {
        let [along, p, q] = self.pointings(attitude);
        let [phi, first, second] = angle_over_sine(&along, &p, &q);
        let value = nu[0] * p.value + nu[1] * q.value;
        let gradient = nu[0] * p.gradient + nu[1] * q.gradient;
        let hessian = nu[0] * p.hessian + nu[1] * q.hessian;
        let mixed = gradient * along.gradient.transpose();
        phi * hessian
            + first * (mixed + mixed.transpose() + value * along.hessian)
            + second * value * along.gradient * along.gradient.transpose()
    }

    fn pointings(&self, attitude: &Matrix3<f64>) -> [Pointing; 3] {
        let [along, mut p, q] = [self.direction, self.plane[0], self.plane[1]]
            .map(|q| Pointing::new(attitude, &self.axis, &q));
        if along.value < 0.0 && p.value.abs().max(q.value.abs()) < ANTIPODE {
            p.value = ANTIPODE;
        }
        [along, p, q]
    }
}

/// `φ = θ/sin θ` and its first two derivatives by `cos θ`. The component along the direction is `cos θ`; those across
/// it give `sin θ`.
///
/// φ solves `sin²θ φ' = cos θ φ − 1`; near θ = 0 it is `Σ 2ⁿ n!²/(2n+1)! (1 − cos θ)ⁿ`.
fn angle_over_sine(along: &Pointing, p: &Pointing, q: &Pointing) -> [f64; 3] {
    let cosine = along.value;
    let sine_squared = p.value * p.value + q.value * q.value;
    if cosine > SERIES {
        let w = sine_squared / (1.0 + cosine);
        let [mut phi, mut first, mut second] = [1.0; 3];
        for n in (1..=TERMS).rev() {
            let n = f64::from(n);
            let ratio = |lift: f64| (n + lift) / (2.0 * n + 2.0 * lift + 1.0) * (n + lift) / n;
            phi = 1.0 + w * ratio(0.0) * phi;
            first = 1.0 + w * ratio(1.0) * first;
            second = 1.0 + w * ratio(2.0) * second;
        }
        return [phi, -first / 3.0, second * 4.0 / 15.0];
    }
    let sine = sine_squared.sqrt();
    let phi = libm::atan2(sine, cosine) / sine;
    let first = (cosine * phi - 1.0) / sine_squared;
    let second = (phi + 3.0 * cosine * first) / sine_squared;
    [phi, first, second]
}
