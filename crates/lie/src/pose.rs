use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use crate::{Tangent, hat, left_jacobian, log, right_jacobian_inverse};

/// An element of SE(3), which maps body coordinates ρ to `R ρ + x` in the inertial frame.
///
/// Its Lie algebra consists of twists `(ρ, φ)`: six numbers, translation first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// `R`, a rotation.
    pub rotation: Matrix3<f64>,
    /// `x`
    pub translation: Vector3<f64>,
}

impl Pose {
    /// The identity.
    pub fn identity() -> Self {
        Self {
            rotation: Matrix3::identity(),
            translation: Vector3::zeros(),
        }
    }

    /// `exp(ρ, φ) = (exp φ, J_l(φ) ρ)`.
    pub fn exp(twist: &Vector6<f64>) -> Self {
        let (rho, phi) = parts(twist);
        let tangent = Tangent::at(phi);
        Self {
            rotation: tangent.rotation(),
            translation: tangent.jacobian().tr_mul(&rho),
        }
    }

    /// The twist with the smallest rotation angle whose exponential is this pose.
    pub fn log(&self) -> Vector6<f64> {
        let phi = log(&self.rotation);
        join(
            &right_jacobian_inverse(&phi).tr_mul(&self.translation),
            &phi,
        )
    }

    /// The composition that applies `other` first, then `self`.
    pub fn compose(&self, other: &Self) -> Self {
        Self {
            rotation: self.rotation * other.rotation,
            translation: self.rotation * other.translation + self.translation,
        }
    }

    /// The inverse.
    pub fn inverse(&self) -> Self {
        Self {
            rotation: self.rotation.transpose(),
            translation: -self.rotation.tr_mul(&self.translation),
        }
    }

    /// The image `R p + x` of a point `p`.
    pub fn act(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.translation
    }

    /// `Ad`, with `T exp(ξ) T⁻¹ = exp(Ad ξ)`.
    pub fn adjoint(&self) -> Matrix6<f64> {
        blocks(
            &self.rotation,
            &(hat(&self.translation) * self.rotation),
            &self.rotation,
        )
    }

    /// `J_l(ξ)`: `exp(ξ + δ) = exp(J_l(ξ) δ) exp(ξ)` to first order.
    ///
    /// With `x = J_l(φ) ρ`, the off-diagonal block is `∂x/∂φ + S(x) J_l(φ)`, because a change of `exp(ξ)` from the left
    /// by `(a, b)` moves x by `a + b × x`.
    pub fn left_jacobian(twist: &Vector6<f64>) -> Matrix6<f64> {
        let (rho, phi) = parts(twist);
        let j = left_jacobian(&phi);
        blocks(&j, &coupling(&rho, &phi, &j), &j)
    }

    /// `J_r(ξ) = J_l(−ξ)`: `exp(ξ + δ) = exp(ξ) exp(J_r(ξ) δ)` to first order.
    pub fn right_jacobian(twist: &Vector6<f64>) -> Matrix6<f64> {
        Self::left_jacobian(&-twist)
    }

    /// `J_l(ξ)⁻¹`, for `|φ| < 2π`.
    pub fn left_jacobian_inverse(twist: &Vector6<f64>) -> Matrix6<f64> {
        let (rho, phi) = parts(twist);
        let inverse = right_jacobian_inverse(&phi).transpose();
        let q = coupling(&rho, &phi, &left_jacobian(&phi));
        blocks(&inverse, &(-inverse * q * inverse), &inverse)
    }

    /// `J_r(ξ)⁻¹ = J_l(−ξ)⁻¹`.
    pub fn right_jacobian_inverse(twist: &Vector6<f64>) -> Matrix6<f64> {
        Self::left_jacobian_inverse(&-twist)
    }
}

/// `∂(J_l(φ) ρ)/∂φ + S(J_l(φ) ρ) J_l(φ)`, given `J_l(φ)`.
fn coupling(rho: &Vector3<f64>, phi: &Vector3<f64>, j: &Matrix3<f64>) -> Matrix3<f64> {
    hat(&(j * rho)) * j - Tangent::at(-phi).derivative(rho)
}

fn parts(twist: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let [a, b, c, d, e, f] = (*twist).into();
    (Vector3::new(a, b, c), Vector3::new(d, e, f))
}

fn join(rho: &Vector3<f64>, phi: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(rho.x, rho.y, rho.z, phi.x, phi.y, phi.z)
}

/// `[[a, b], [0, c]]`
fn blocks(a: &Matrix3<f64>, b: &Matrix3<f64>, c: &Matrix3<f64>) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(a);
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(b);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(c);
    matrix
}
