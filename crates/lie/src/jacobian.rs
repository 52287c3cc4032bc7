//! The Jacobians of SO(3), their inverses, and the second derivative of the logarithm.

use nalgebra::{Matrix3, Vector3};

use crate::{Tangent, hat};

/// Squared angle below which the coefficients use their series. The first omitted term is below rounding there.
const SMALL_SQUARED: f64 = 0.04;

/// `|B_2n|/(2n)!` for n = 1, 2, …: coefficients of the series of `c` in θ².
const BERNOULLI: [f64; 7] = [
    1.0 / 12.0,
    1.0 / 720.0,
    1.0 / 30_240.0,
    1.0 / 1_209_600.0,
    1.0 / 47_900_160.0,
    691.0 / 1_307_674_368_000.0,
    1.0 / 74_724_249_600.0,
];

/// `J_r(v)`: to first order, a change `δv` changes `exp(v)` by `exp(v) S(J_r(v) δv)`.
pub fn right_jacobian(v: &Vector3<f64>) -> Matrix3<f64> {
    Tangent::at(*v).jacobian()
}

/// `J_l(v) = J_r(v)ᵀ = ∫₀¹ exp(τ v) dτ`: to first order, a change `δv` changes `exp(v)` by `S(J_l(v) δv) exp(v)`.
pub fn left_jacobian(v: &Vector3<f64>) -> Matrix3<f64> {
    right_jacobian(v).transpose()
}

/// `J_r(e)⁻¹ = I + ½ S(e) + c S(e)²` with `c = (1 − (θ/2) cot(θ/2)) / θ²`, for `|e| < 2π`.
///
/// It maps a left-trivialized variation ζ of `R` (`δR = R S(ζ)`) to the variation of `e = log R`.
pub fn right_jacobian_inverse(e: &Vector3<f64>) -> Matrix3<f64> {
    let (c, _) = cotangent(e.norm_squared());
    let s = hat(e);
    Matrix3::identity() + 0.5 * s + c * s * s
}

/// `J_l(e)⁻¹ = J_r(e)⁻ᵀ`.
pub fn left_jacobian_inverse(e: &Vector3<f64>) -> Matrix3<f64> {
    right_jacobian_inverse(e).transpose()
}

/// The Hessian of `ν · log(exp(S(e)) exp(S(ζ)))` with respect to ζ, at ζ = 0.
///
/// The first derivative along a ray `ζ = t v` is `ν · J_r⁻¹(e) v`, with `ė = J_r⁻¹(e) v` and `J_r⁻¹ = I + ½ S(e) + c
/// S(e)²`. The second derivative follows from differentiating `J_r⁻¹` along ė. It is the symmetric part of `K J_r⁻¹`
/// with `K = ½ S(ν) + c [e νᵀ + (ν·e) I − 2 ν eᵀ] + 2c' [(ν·e) e − θ² ν] eᵀ`, where `c' = dc/dθ²`.
pub fn log_curvature(e: &Vector3<f64>, nu: &Vector3<f64>) -> Matrix3<f64> {
    let squared = e.norm_squared();
    let (c, slope) = cotangent(squared);
    let along = nu.dot(e);
    let k = 0.5 * hat(nu)
        + c * (e * nu.transpose() + Matrix3::from_diagonal_element(along)
            - 2.0 * nu * e.transpose())
        + 2.0 * slope * (along * e - squared * nu) * e.transpose();
    let product = k * right_jacobian_inverse(e);
    0.5 * (product + product.transpose())
}

/// `c = (1 − (θ/2) cot(θ/2))/θ²` and `dc/dθ²` as functions of `θ²`.
fn cotangent(squared: f64) -> (f64, f64) {
    if squared < SMALL_SQUARED {
        let (mut c, mut slope) = (0.0, 0.0);
        for coefficient in BERNOULLI.iter().rev() {
            slope = slope * squared + c;
            c = c * squared + coefficient;
        }
        return (c, slope);
    }
    let half = 0.5 * squared.sqrt();
    let (sin, cos) = libm::sincos(half);
    let c = (1.0 - half * cos / sin) / squared;
    let slope = ((half / (sin * sin) - cos / sin) / (8.0 * half) - c) / squared;
    (c, slope)
}
