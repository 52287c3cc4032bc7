//! The implicit equation in exponential form (2.3):
//! `G(f) = (sin θ/θ) J f + ((1 − cos θ)/θ²) f × J f = g`, `θ = |f|`, relative to `tr J`.

use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use super::{MAX_ITERATIONS, solve_3x3};
use crate::Inertia;

/// Residual, relative to the terms it is the sum of, that is rounding.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// `sin θ/θ`, `(1 − cos θ)/θ²` and their derivatives divided by θ, as functions of `θ²`.
struct Coefficients {
    sine: f64,
    cosine: f64,
    sine_slope: f64,
    cosine_slope: f64,
}

impl Coefficients {
    fn at(squared: f64) -> Self {
        // Below θ = 0.1 the closed forms cancel; the series' next terms are below rounding there.
        if squared < 1e-2 {
            let q = squared;
            return Self {
                sine: 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0))),
                cosine: 0.5 - q / 24.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0))),
                sine_slope: -(1.0 - q / 10.0 * (1.0 - q / 28.0 * (1.0 - q / 54.0))) / 3.0,
                cosine_slope: -(1.0 - q / 15.0 * (1.0 - q * (3.0 / 112.0) * (1.0 - q / 67.5)))
                    / 12.0,
            };
        }
        let angle = squared.sqrt();
        let (sin, cos) = libm::sincos(angle);
        let sine = sin / angle;
        let cosine = (1.0 - cos) / squared;
        Self {
            sine,
            cosine,
            sine_slope: (cos - sine) / squared,
            cosine_slope: (sine - 2.0 * cosine) / squared,
        }
    }
}

/// Newton's method from `f` for `g / tr J`: the rotation vector and the corrections made; `None` when it does not converge.
pub(super) fn newton(
    inertia: &Inertia,
    g: &Vector3<f64>,
    mut f: Vector3<f64>,
) -> Option<(Vector3<f64>, u32)> {
    let magnitude = g.norm();
    for iterations in 0..=MAX_ITERATIONS {
        let k = Coefficients::at(f.norm_squared());
        let jf = inertia.unit * f;
        let fjf = f.cross(&jf);
        let residual = k.sine * jf + k.cosine * fjf - g;
        if residual.norm() <= ROUNDING * (magnitude + jf.norm()) {
            return Some((f, iterations));
        }
        let jacobian: Matrix3<f64> = k.sine_slope * jf * f.transpose()
            + k.sine * inertia.unit
            + k.cosine_slope * fjf * f.transpose()
            + k.cosine * (hat(&f) * inertia.unit - hat(&jf));
        f -= solve_3x3(&jacobian, &residual)?;
    }
    None
}
