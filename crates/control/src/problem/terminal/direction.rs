use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::problem::pointing::{Pointing, across};

/// Two conditions that point a body axis `a` along a direction `d`: the components across `d` of the rotation that turns
/// `d` into `R a` by the shortest way, but for a quarter turn: `φ(d·Ra) (p·Ra)` and `φ(d·Ra) (q·Ra)` with `d`, `p`, `q`
/// a triad and `φ = θ/sin θ`. Their norm is the angle θ between the two, up to a half turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Direction {
    pub(super) axis: Vector3<f64>,
    pub(super) direction: Vector3<f64>,
    plane: [Vector3<f64>; 2],
}

/// Above this cosine φ uses its series in `1 − cos θ`.
const SERIES: f64 = 0.8;

/// The series' terms fall by about a tenth each.
const TERMS: u32 = 18;

/// The sine of the angle at which an axis that points exactly the other way is taken to lie off it.
const ANTIPODE: f64 = 1e-8;

impl Direction {
    /// The body axis `axis` along `direction`, both unit vectors.
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

/// `φ = θ/sin θ` and its first two derivatives by `cos θ`, the component along the direction; those across it are the
/// sine's.
///
/// It solves `sin²θ φ' = cos θ φ − 1`; near θ = 0 it is `Σ 2ⁿ n!²/(2n+1)! (1 − cos θ)ⁿ`.
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
