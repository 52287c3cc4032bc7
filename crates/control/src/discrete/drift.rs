//! The free motion of the center of mass and of the attitude over a step, with its derivatives.
//!
//! A variation `[p, m]` of pose and momentum becomes `p⁺ = P_p p + P_m m`, `m⁺ = M_m m`.

use lgvi_dynamics::rotation::{self, RelativeRotation, Unsolvable};
use lgvi_dynamics::{BodyState, RigidBody};
use lgvi_lie::{compose, hat, rotate_back};
use nalgebra::{Matrix3, Vector3};

use super::linear::{Blocks, Turn, TurnCurvature};
use super::stored::{StoredCurvature, StoredTurn};
use crate::shooting::inverse;

/// The derivatives of `[x, γ]` at the end of a drift over h from the state `begun` by those at its beginning.
pub(crate) fn glide_gradient(body: &RigidBody, h: f64, begun: &BodyState) -> Blocks {
    let straight = || {
        let unit = Matrix3::identity();
        let none = Matrix3::zeros();
        [[unit, unit * (h / body.mass())], [none, unit]]
    };
    let slowed = body.glide_derivatives(begun, h, 1.0);
    slowed.map_or_else(straight, |slowed| slowed.gradient())
}

/// The rotation of a drift with its derivatives, by the variations at its beginning.
pub(crate) trait Drift {
    /// First derivatives by attitude and momentum.
    fn gradient(&self, body: &RigidBody) -> Turn;

    /// First derivatives by a stored momentum, if there is one.
    fn stored_gradient(&self, _first: &Turn) -> Option<StoredTurn> {
        None
    }

    /// Second derivatives of `λ³·log + λ⁴·Π⁺` by attitude and momentum.
    fn curvature(
        &self,
        body: &RigidBody,
        first: &Turn,
        third: &Vector3<f64>,
        fourth: &Vector3<f64>,
    ) -> TurnCurvature;

    /// Those by a stored momentum, if there is one; `own` are those without it.
    fn stored_curvature(
        &self,
        _first: &Turn,
        _own: &TurnCurvature,
        _third: &Vector3<f64>,
        _fourth: &Vector3<f64>,
    ) -> Option<StoredCurvature> {
        None
    }
}

/// The rotation of a drift: `h S(Π) = F J_d − J_d Fᵀ`, `R⁺ = R F`, `P = Π⁺ = FᵀΠ`.
///
/// Let `F exp S(η)` be the rotation for `Π + δ`. To second order, `η = Ξδ + ½Ξ₂(δ, δ)` with `Ξ = h Fᵀ B⁻¹`, `B = tr[F
/// J_d] I − F J_d` and `w·Ξ₂(δ, δ) = aᵀ(Q − tr[Q] I) a`, `a = Ξδ`, `Q = J_d S(v) F`, `v = B⁻ᵀ F w`. A variation ζ
/// before the drift becomes `log(exp S(Fᵀζ) exp S(η)) = Fᵀζ + η + ½ Fᵀζ × η + …`, and `Π⁺ = exp S(η)ᵀ (P + Fᵀδ)`.
pub(crate) struct RotationDrift {
    h: f64,
    turn: RelativeRotation,
    /// `P`
    momentum: Vector3<f64>,
}

impl RotationDrift {
    /// Turns the attitude.
    #[inline(always)]
    pub(crate) fn new(body: &RigidBody, h: f64, state: &mut BodyState) -> Result<Self, Unsolvable> {
        let turn = rotation::solve(body.inertia(), &(h * state.angular_momentum))?;
        state.attitude = compose(&state.attitude, &turn.cayley);
        state.angular_momentum = rotate_back(&turn.cayley, &state.angular_momentum);
        Ok(Self {
            h,
            turn,
            momentum: state.angular_momentum,
        })
    }
}

impl Drift for RotationDrift {
    #[inline(always)]
    fn gradient(&self, body: &RigidBody) -> Turn {
        let relative = self.turn.matrix();
        let f_t = relative.transpose();
        let f_jd = relative * body.inertia().nonstandard();
        let b = Matrix3::from_diagonal_element(f_jd.trace()) - f_jd;
        let xi = f_t * (self.h * inverse(&b));
        Turn {
            pose: f_t,
            pose_by_momentum: xi,
            momentum: f_t + hat(&self.momentum) * xi,
        }
    }

    /// Second derivatives of `λ³·log + λ⁴·Π⁺`. With `w = λ³ + λ⁴ × P`, `Q' = Q + λ⁴ Pᵀ` and `X = F S(λ⁴) Ξ` they are
    /// `H_ζΠ = −½ F S(λ³) Ξ`, `H_ΠΠ = Ξᵀ(½(Q' + Q'ᵀ) − tr[Q'] I) Ξ − X − Xᵀ`.
    #[inline]
    fn curvature(
        &self,
        body: &RigidBody,
        first: &Turn,
        third: &Vector3<f64>,
        fourth: &Vector3<f64>,
    ) -> TurnCurvature {
        let (relative, xi) = (first.pose.transpose(), &first.pose_by_momentum);
        let j_d = body.inertia().nonstandard();
        let xi_t = xi.transpose();
        let w = third + fourth.cross(&self.momentum);
        let v = xi_t * w / self.h;
        let q = j_d * (hat(&v) * relative) + fourth * self.momentum.transpose();
        let middle = 0.5 * (q + q.transpose()) - Matrix3::from_diagonal_element(q.trace());
        let x = relative * (hat(fourth) * xi);
        TurnCurvature {
            pose_momentum: relative * (hat(&(-0.5 * third)) * xi),
            momentum_momentum: xi_t * (middle * xi) - x - x.transpose(),
        }
    }
}
