use lgvi_lie::{hat, right_jacobian_inverse};
use nalgebra::{Matrix3, Vector3};

/// Below this squared angle the coefficients use their series, whose next term is below rounding.
const SMALL_SQUARED: f64 = 0.04;

/// `|B_2n|/(2n)!` for n = 1, 2, …: the series of `c` in θ².
const BERNOULLI: [f64; 7] = [
    1.0 / 12.0,
    1.0 / 720.0,
    1.0 / 30_240.0,
    1.0 / 1_209_600.0,
    1.0 / 47_900_160.0,
    691.0 / 1_307_674_368_000.0,
    1.0 / 74_724_249_600.0,
];

/// The Hessian by ζ at 0 of `ν · log(exp(S(e)) exp(S(ζ)))`.
///
/// Along a ray `ζ = t v` its derivative is `ν · J_r⁻¹(e) v` with `ė = J_r⁻¹(e) v` and `J_r⁻¹ = I + ½ S(e) + c S(e)²`.
/// The second is that of `J_r⁻¹` along ė, which is the symmetric part of `K J_r⁻¹`,
/// `K = ½ S(ν) + c [e νᵀ + (ν·e) I − 2 ν eᵀ] + 2c' [(ν·e) e − θ² ν] eᵀ`, where `c' = dc/dθ²`.
pub(super) fn log_curvature(e: &Vector3<f64>, nu: &Vector3<f64>) -> Matrix3<f64> {
    let squared = e.norm_squared();
    let (c, slope) = coefficients(squared);
    let along = nu.dot(e);
    let k = 0.5 * hat(nu)
        + c * (e * nu.transpose() + Matrix3::from_diagonal_element(along)
            - 2.0 * nu * e.transpose())
        + 2.0 * slope * (along * e - squared * nu) * e.transpose();
    let product = k * right_jacobian_inverse(e);
    0.5 * (product + product.transpose())
}

/// `c = (1 − (θ/2) cot(θ/2))/θ²` and `dc/dθ²`.
fn coefficients(squared: f64) -> (f64, f64) {
    if squared < SMALL_SQUARED {
        let (mut c, mut slope) = (0.0, 0.0);
        for coefficient in BERNOULLI.iter().rev() {
            slope = slope * squared + c;
            c = c * squared + coefficient;
        }
        return (c, slope);
    }
    let half = 0.5 * squared.sqrt();
    let (sin, cos) = (libm::sin(half), libm::cos(half));
    let c = (1.0 - half * cos / sin) / squared;
    let slope = ((half / (sin * sin) - cos / sin) / (8.0 * half) - c) / squared;
    (c, slope)
}
