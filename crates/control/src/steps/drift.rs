//! Free motion over a step, and what small changes of poses and momenta make of it.

use lgvi_dynamics::rotation::{Chart, Unsolvable};
use lgvi_dynamics::{BodyState, RigidBody};
use lgvi_lie::{compose, hat, rotate_back};
use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::stage::inverse;

/// First derivatives of a drift by poses and momenta; poses do not change momenta.
pub(crate) struct DriftGradient<const P: usize> {
    pub(crate) pose_by_pose: SMatrix<f64, P, P>,
    pub(crate) pose_by_momentum: SMatrix<f64, P, P>,
    pub(crate) momentum_by_momentum: SMatrix<f64, P, P>,
}

/// Second derivatives of a drift in the directions of multipliers; by poses twice there are none.
pub(crate) struct DriftCurvature<const P: usize> {
    pub(crate) pose_momentum: SMatrix<f64, P, P>,
    /// Symmetric.
    pub(crate) momentum_momentum: SMatrix<f64, P, P>,
}

/// `x + (h/m) γ`.
pub(crate) fn glide(body: &RigidBody, h: f64, state: &BodyState) -> Vector3<f64> {
    state.position + (h / body.mass()) * state.linear_momentum
}

/// The turn of a drift: `h S(Π) = F J_d − J_d Fᵀ`, `R⁺ = R F`, `P = Π⁺ = FᵀΠ`.
///
/// With `F exp S(η)` the turn of `Π + δ`, to second order `η = Ξδ + ½Ξ₂(δ, δ)`: `Ξ = h Fᵀ B⁻¹`, `B = tr[F J_d] I − F J_d`,
/// and `w·Ξ₂(δ, δ) = aᵀ(Q − tr[Q] I) a`, `a = Ξδ`, `Q = J_d S(v) F`, `v = B⁻ᵀ F w`. A change ζ before the drift becomes
/// `log(exp S(Fᵀζ) exp S(η)) = Fᵀζ + η + ½ Fᵀζ × η + …`, and `Π⁺ = exp S(η)ᵀ (P + Fᵀδ)`.
pub(crate) struct Turn {
    h: f64,
    cayley: Vector3<f64>,
    /// `F`
    relative: Matrix3<f64>,
    /// `P`
    momentum: Vector3<f64>,
    j_d: Matrix3<f64>,
}

impl Turn {
    pub(crate) fn new(
        body: &RigidBody,
        h: f64,
        angular_momentum: &Vector3<f64>,
    ) -> Result<Self, Unsolvable> {
        let turn = Chart::Cayley.solve(body.inertia(), &(h * angular_momentum), None)?;
        Ok(Self {
            h,
            cayley: turn.cayley,
            relative: turn.matrix(),
            momentum: rotate_back(&turn.cayley, angular_momentum),
            j_d: *body.inertia().nonstandard(),
        })
    }

    /// Turns the attitude and carries the angular momentum over.
    pub(crate) fn apply(&self, state: &mut BodyState) {
        state.attitude = compose(&state.attitude, &self.cayley);
        state.angular_momentum = self.momentum;
    }

    /// `Fᵀ`, `Ξ`, `Fᵀ + S(P) Ξ`.
    pub(crate) fn gradient(&self) -> DriftGradient<3> {
        let f_t = self.relative.transpose();
        let f_jd = self.relative * self.j_d;
        let b = Matrix3::from_diagonal_element(f_jd.trace()) - f_jd;
        let xi = f_t * (self.h * inverse(&b));
        DriftGradient {
            pose_by_pose: f_t,
            pose_by_momentum: xi,
            momentum_by_momentum: f_t + hat(&self.momentum) * xi,
        }
    }

    /// Of `λ³·log + λ⁴·Π⁺`: with `w = λ³ + λ⁴ × P`, `Q' = Q + λ⁴ Pᵀ` and `X = F S(λ⁴) Ξ`,
    /// `H_ζΠ = −½ F S(λ³) Ξ`, `H_ΠΠ = Ξᵀ(½(Q' + Q'ᵀ) − tr[Q'] I) Ξ − X − Xᵀ`.
    pub(crate) fn curvature(
        &self,
        gradient: &DriftGradient<3>,
        third: &Vector3<f64>,
        fourth: &Vector3<f64>,
    ) -> DriftCurvature<3> {
        let xi = &gradient.pose_by_momentum;
        let w = third + fourth.cross(&self.momentum);
        let v = xi.tr_mul(&w) / self.h;
        let q = self.j_d * hat(&v) * self.relative + fourth * self.momentum.transpose();
        let middle = 0.5 * (q + q.transpose()) - Matrix3::from_diagonal_element(q.trace());
        let x = self.relative * hat(fourth) * xi;
        DriftCurvature {
            pose_momentum: -0.5 * (self.relative * hat(third) * xi),
            momentum_momentum: xi.tr_mul(&(middle * xi)) - x - x.transpose(),
        }
    }
}
