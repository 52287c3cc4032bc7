//! The field as a series of solid harmonics, for distances at which its truncation is below rounding.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f64x8};
use nalgebra::Vector3;

use super::Polyhedron;
use super::frame::Frame;
use super::harmonics::{self, Row};
use super::mesh::{Numbers, WIDTH};
use crate::lane::vectorize_wide;

/// Bound of the truncated part of the acceleration, relative to that of a point mass.
const TRUNCATION: f64 = 0.5 * f64::EPSILON;

/// Limits of the highest degree.
const DEGREES: [usize; 2] = [8, 96];

/// Cost of a series of degree n, in multiples of that of a face: `(n + PREPARATION)²/PER_FACE`.
const PER_FACE: f64 = 30.0;
const PREPARATION: usize = 14;

/// Potential and acceleration of a body of unit mass in its [`Frame`], in the unit of that frame.
///
/// With the irregular harmonics `I_n^m = (n − m)!/n! P_n^m(cos θ) e^{imφ}/r^{n+1}`, the potential is `−Σ conj(M_n^m) I_n^m`
/// with the moments `M_n^m = ∫ R_n^m dm`, and a component of the acceleration the same sum with the moments of a derivative
/// of `R_n^m`. The harmonics are `I_n^m = (2m − 1)!!/m! q_n^m [(x + iy)/r²]^m/r` with `q_m^m = 1` and `(n + 1) r² q_{n+1}^m =
/// (2n + 1) z q_n^m − (n² − m²)/n q_{n−1}^m`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Series {
    /// Squares of the distances from which a series up to each degree suffices, in falling order.
    limits: Vec<f64>,
    potential: Sum<1>,
    acceleration: Sum<3>,
}

impl Series {
    pub(super) fn new(level: Level, polyhedron: &Polyhedron, frame: &Frame) -> Self {
        let faces = polyhedron.faces.len() as f64;
        let affordable = libm::sqrt(PER_FACE * faces) as usize;
        let [least, most] = DEGREES;
        let degree = affordable.saturating_sub(PREPARATION).clamp(least, most);
        let moments = harmonics::moments(level, polyhedron, frame, degree + 1);
        let slopes = [0, 1, 2].map(|axis| {
            let row = |n: usize| harmonics::derivative(&moments[n.max(1) - 1], n, axis);
            (0..=degree + 1).map(row).collect::<Vec<_>>()
        });
        Self {
            limits: limits(polyhedron, frame, degree, TRUNCATION),
            potential: Sum::new([&moments[..=degree]]),
            acceleration: Sum::new(slopes.each_ref().map(Vec::as_slice)),
        }
    }

    /// Cost of its highest degree, in multiples of that of a face.
    pub(super) fn cost(&self) -> f64 {
        let terms = (self.limits.len() + PREPARATION) as f64;
        terms * terms / PER_FACE
    }

    /// The lowest degree that suffices at this place, if there is one.
    pub(super) fn degree(&self, d: &Vector3<f64>) -> Option<usize> {
        let squared = d.norm_squared();
        let degree = self.limits.partition_point(|limit| *limit > squared);
        (degree < self.limits.len()).then_some(degree)
    }

    pub(super) fn potential(&self, level: Level, d: &Vector3<f64>, degree: usize) -> f64 {
        let [sum] = self.potential.at(level, d, degree);
        -sum
    }

    pub(super) fn acceleration(
        &self,
        level: Level,
        d: &Vector3<f64>,
        degree: usize,
    ) -> Vector3<f64> {
        -Vector3::from(self.acceleration.at(level, d, degree + 1))
    }
}

/// The squares of the distances from which the terms beyond each degree are together below `truncation`, relative to the
/// acceleration of a point mass.
///
/// The term of degree n of the acceleration is at most `(n + 1) ∫ ρ^n dm/r^{n+2}`. A cone between the center and a face that
/// is nowhere further than a from it contributes at most `3 a^n/(n + 3)` of its mass to the integral.
pub(super) fn limits(
    polyhedron: &Polyhedron,
    frame: &Frame,
    degree: usize,
    truncation: f64,
) -> Vec<f64> {
    let count = 2 * degree;
    let (mut mass, mut reach) = (0.0, 0.0_f64);
    let mut bounds = vec![0.0; count];
    for face in &polyhedron.faces {
        let [a, b, c] = face.map(|corner| frame.local(&polyhedron.vertices[corner]));
        let furthest = a.norm().max(b.norm()).max(c.norm());
        let cone = a.dot(&b.cross(&c));
        mass += cone;
        reach = reach.max(furthest);
        let mut power = cone.abs();
        for bound in &mut bounds {
            *bound += power;
            power *= furthest;
        }
    }
    for (n, bound) in bounds.iter_mut().enumerate() {
        *bound *= 3.0 * (n + 1) as f64 / (mass * (n + 3) as f64);
    }
    // The center of mass is the origin.
    bounds[1] = 0.0;
    let last = bounds[count - 1] / count as f64;
    let tail = |degree: usize, distance: f64| {
        let x = 1.0 / distance;
        let (mut sum, mut power) = (0.0, 1.0);
        for (n, bound) in bounds.iter().enumerate() {
            if n > degree {
                sum += bound * power;
            }
            power *= x;
        }
        // Beyond the bounds, each `∫ ρ^n dm` is at most `reach` times the one before.
        let (n, x) = (count as f64, reach * x);
        let others = (n + 1.0 - n * x) / ((1.0 - x) * (1.0 - x));
        sum + last * reach * power * others
    };
    let limit = |degree: usize| {
        let (mut near, mut far) = (0.0, 60.0);
        for _ in 0..50 {
            let middle = 0.5 * (near + far);
            if tail(degree, reach * libm::exp2(middle)) > truncation {
                near = middle;
            } else {
                far = middle;
            }
        }
        let distance = reach * libm::exp2(far);
        distance * distance
    };
    (0..=degree).map(limit).collect()
}

/// Coefficients of `Σ Re[conj(C_n^m) I_n^m]` over all orders m, of K sums at once, eight orders side by side: for each eight,
/// degree by degree from the lowest order on, real and imaginary parts.
#[derive(Clone, Debug, PartialEq)]
struct Sum<const K: usize> {
    degree: usize,
    /// `(2n + 1)/(n + 1)` and `1/(n² + n)`, 0 for n = 0.
    factors: Vec<[f64; 2]>,
    coefficients: Vec<[[Numbers; 2]; K]>,
}

impl<const K: usize> Sum<K> {
    fn new(rows: [&[Row<f64>]; K]) -> Self {
        let degree = rows[0].len() - 1;
        let mut coefficients = Vec::new();
        for first in (0..=degree).step_by(WIDTH) {
            for n in first..=degree {
                let mut of_degree = [[[0.0; WIDTH]; 2]; K];
                for (coefficients, rows) in of_degree.iter_mut().zip(rows) {
                    for m in first..=n.min(first + WIDTH - 1) {
                        // Negative orders contribute as much as positive ones.
                        let orders = if m == 0 { 1.0 } else { 2.0 };
                        let odd = (1..=m).map(|k| (2 * k - 1) as f64 / k as f64);
                        let factor = orders * odd.product::<f64>();
                        coefficients[0][m - first] = factor * rows[n].re[m];
                        coefficients[1][m - first] = factor * rows[n].im[m];
                    }
                }
                coefficients.push(of_degree);
            }
        }
        let factors = (0..=degree).map(|n| {
            let [n, next] = [n as f64, n as f64 + 1.0];
            [
                (n + next) / next,
                if n > 0.0 { 1.0 / (n * next) } else { 0.0 },
            ]
        });
        Self {
            degree,
            factors: factors.collect(),
            coefficients,
        }
    }

    /// The sums up to `degree`.
    fn at(&self, level: Level, d: &Vector3<f64>, degree: usize) -> [f64; K] {
        vectorize_wide!(level, simd => self.sum(simd, d, degree))
    }

    #[inline(always)]
    fn sum<S: Simd>(&self, simd: S, d: &Vector3<f64>, degree: usize) -> [f64; K] {
        let by_squared = 1.0 / d.norm_squared();
        let along = d.z * by_squared;
        // [(x + iy)/r²]^k for k up to 7 side by side, and for k = 8
        let turn = [d.x * by_squared, d.y * by_squared];
        let (mut re, mut im) = ([0.0; WIDTH], [0.0; WIDTH]);
        let mut power = [1.0, 0.0];
        for (re, im) in re.iter_mut().zip(&mut im) {
            [*re, *im] = power;
            power = multiplied(power, turn);
        }
        let zero = simd.splat_f64x8(0.0);
        let (re, im): (f64x8<S>, f64x8<S>) = (re.simd_into(simd), im.simd_into(simd));
        let mut base = [by_squared.sqrt(), 0.0];
        let mut sums = [zero; K];
        let mut rest = self.coefficients.as_slice();
        for first in (0..=degree).step_by(WIDTH) {
            let (own, others) = rest.split_at(self.degree + 1 - first);
            rest = others;
            let orders: f64x8<S> = ORDERS.simd_into(simd);
            let orders = orders + first as f64;
            let squares = orders * orders;
            let (mut q, mut last) = (zero, zero);
            let mut parts = [[zero; 2]; K];
            for (n, coefficients) in (first..=degree).zip(own) {
                if let Some(start) = STARTS.get(n - first) {
                    q += f64x8::from_slice(simd, start);
                }
                for (parts, coefficients) in parts.iter_mut().zip(coefficients) {
                    parts[0] += f64x8::from_slice(simd, &coefficients[0]) * q;
                    parts[1] += f64x8::from_slice(simd, &coefficients[1]) * q;
                }
                let [two, one] = self.factors[n];
                let next =
                    q * (two * along) - last * ((-squares + (n * n) as f64) * (one * by_squared));
                (q, last) = (next, q);
            }
            let turned = [re * base[0] - im * base[1], re * base[1] + im * base[0]];
            for (sum, parts) in sums.iter_mut().zip(parts) {
                *sum += parts[0] * turned[0] + parts[1] * turned[1];
            }
            base = multiplied(base, power);
        }
        let mut totals = [0.0; K];
        for (total, sum) in totals.iter_mut().zip(sums) {
            let lanes: Numbers = sum.into();
            *total = lanes.iter().sum();
        }
        totals
    }
}

const ORDERS: Numbers = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// `q_m^m = 1` of each order.
const STARTS: [Numbers; WIDTH] = {
    let mut starts = [[0.0; WIDTH]; WIDTH];
    let mut k = 0;
    while k < WIDTH {
        starts[k][k] = 1.0;
        k += 1;
    }
    starts
};

#[inline(always)]
fn multiplied([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a * c - b * d, a * d + b * c]
}
