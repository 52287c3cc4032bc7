//! The component of a body axis along an inertial direction, with its derivatives.

use nalgebra::{Matrix3, Vector3};

/// `q · R a` for a body axis `a`, with its gradient and Hessian by ζ where `R` moves to `R exp S(ζ)`: `a × b` and `½ (a
/// bᵀ + b aᵀ) − (a · b) I` with `b = Rᵀ q`.
pub(crate) struct Pointing {
    pub(crate) value: f64,
    pub(crate) gradient: Vector3<f64>,
    pub(crate) hessian: Matrix3<f64>,
}

impl Pointing {
    pub(crate) fn new(attitude: &Matrix3<f64>, axis: &Vector3<f64>, q: &Vector3<f64>) -> Self {
        let b = attitude.tr_mul(q);
        let value = axis.dot(&b);
        let product = axis * b.transpose();
        Self {
            value,
            gradient: axis.cross(&b),
            hessian: 0.5 * (product + product.transpose()) - Matrix3::from_diagonal_element(value),
        }
    }
}

/// Two unit vectors that form a right-handed triad with the unit vector `n`. They are smooth in `n` except where the
/// sign of its last component changes.
pub(crate) fn across(n: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        Vector3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vector3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}
