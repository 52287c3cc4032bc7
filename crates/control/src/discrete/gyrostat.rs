//! Steps of the attitude of a body with reaction wheels.
//!
//! The wheels store the angular momentum `s` in the body frame. It takes the place of the linear momentum in states,
//! variations and kicks: a command acts on it and, oppositely, on the body. The position is that of the orbit, which is
//! given, and is no coordinate: its rows are zero. Where the speeds of wheels have limits, and more wheels than axes, the momenta
//! `q` that they exchange among each other are in its place: `q⁺ = q + h N u`.

use std::sync::Arc;

use lgvi_dynamics::gravity::Field;
use lgvi_dynamics::rotation::{Unsolvable, solve_gyrostat};
use lgvi_dynamics::{BodyState, Load, RigidBody};
use lgvi_lie::{Quaternion, exp, hat, log};
use nalgebra::{Matrix3, Vector3};

use super::coordinates::{Coordinates, Variations, symmetric};
use super::drift::Drift;
use super::linear::{Blocks, Turn, TurnCurvature};
use super::stored::{StoredCurvature, StoredTurn};
use super::{DecouplingError, KickDriftKick};
use crate::Transfer;
use crate::problem::constraint::resampled;
use crate::problem::{Vector12, block};

/// The attitude and the stored momentum. The position follows the orbit.
pub(crate) struct Gyrostat {
    orbit: Arc<[Vector3<f64>]>,
    /// True if exchanged momenta are in the place of positions.
    exchanges: bool,
}

impl<'t, const U: usize> KickDriftKick<'t, Gyrostat, 2, U> {
    /// The steps of a transfer by wheels, under the first `U` commands of its actuation.
    ///
    /// # Errors
    /// Returns an error if the transfer has no orbit.
    pub(crate) fn gyrostat(transfer: &'t Transfer) -> Result<Self, DecouplingError> {
        let orbit = transfer
            .orbit
            .as_ref()
            .ok_or(DecouplingError::NotFinite { step: 0 })?;
        let matrix = transfer.actuation.matrix();
        let commands = [0, 3].map(|row| matrix.fixed_view::<3, U>(row, 0).into_owned());
        let orbit = resampled(orbit, transfer.intervals);
        let off = transfer.off_by_step(Some);
        let exchange = transfer.exchange.as_deref();
        let exchanges = exchange.is_some();
        let steps = Self::new(transfer, Gyrostat { orbit, exchanges }, commands, off);
        Ok(match exchange {
            Some(exchange) => steps.exchanging(&exchange.fixed_columns::<U>(0).into_owned()),
            None => steps,
        })
    }
}

impl Coordinates<2> for Gyrostat {
    type Drift = GyrostatDrift;
    const GLIDES: bool = false;
    const STORES: bool = true;

    fn at(&self, k: usize, state: &BodyState) -> BodyState {
        BodyState {
            position: self.orbit[k],
            ..*state
        }
    }

    fn drift(
        &self,
        k: usize,
        body: &RigidBody,
        [h, _]: [f64; 2],
        state: &mut BodyState,
    ) -> Result<Option<GyrostatDrift>, Unsolvable> {
        state.position = self.orbit[k + 1];
        GyrostatDrift::new(body, h, state).map(Some)
    }

    fn kick(&self, [torque, moment]: &[Vector3<f64>; 2], state: &mut BodyState) {
        state.linear_momentum += torque;
        state.angular_momentum += moment;
    }

    fn load(&self, field: &dyn Field, body: &RigidBody, state: &BodyState) -> [Vector3<f64>; 2] {
        let load = field.load(body, &state.position, &state.attitude);
        [Vector3::zeros(), load.moment]
    }

    fn gradient(&self, field: &dyn Field, body: &RigidBody, state: &BodyState) -> Blocks {
        let gradient = field.gradient(body, &state.position, &state.attitude);
        by_attitude(gradient.moment_by_attitude)
    }

    fn curvature(
        &self,
        field: &dyn Field,
        body: &RigidBody,
        state: &BodyState,
        &[_, moment]: &[Vector3<f64>; 2],
    ) -> Blocks {
        let force = Vector3::zeros();
        let weights = Load { force, moment };
        let curvature = field.curvature(body, &state.position, &state.attitude, &weights);
        by_attitude(symmetric(&curvature.attitude_attitude))
    }

    fn complete(&self, states: &mut [BodyState]) {
        if let [first, rest @ ..] = states {
            for state in rest {
                state.linear_momentum = balance(first, state);
                if self.exchanges {
                    state.position = first.position;
                }
            }
        }
    }
}

/// The stored momentum with which a state has the total angular momentum of another one.
pub(crate) fn balance(other: &BodyState, state: &BodyState) -> Vector3<f64> {
    let total = other.attitude * (other.angular_momentum + other.linear_momentum);
    state.attitude.tr_mul(&total) - state.angular_momentum
}

/// Derivatives of the second group by its own pose.
fn by_attitude(block: Matrix3<f64>) -> Blocks {
    let none = Matrix3::zeros();
    [[none, none], [none, block]]
}

impl Variations<12> for Gyrostat {
    fn difference(&self, from: &BodyState, to: &BodyState) -> Vector12 {
        let mut z = Vector12::zeros();
        if self.exchanges {
            z.fixed_rows_mut::<3>(0)
                .copy_from(&(to.position - from.position));
        }
        let parts = [
            to.linear_momentum - from.linear_momentum,
            log(&from.attitude.tr_mul(&to.attitude)),
            to.angular_momentum - from.angular_momentum,
        ];
        for (which, part) in parts.iter().enumerate() {
            z.fixed_rows_mut::<3>(3 * which + 3).copy_from(part);
        }
        z
    }

    fn moved(&self, state: &BodyState, z: &Vector12) -> BodyState {
        BodyState {
            position: if self.exchanges {
                state.position + block(z, 0)
            } else {
                state.position
            },
            linear_momentum: state.linear_momentum + block(z, 1),
            attitude: state.attitude * exp(&block(z, 2)),
            angular_momentum: state.angular_momentum + block(z, 3),
        }
    }
}

/// The rotation of a drift with a stored momentum: `h S(P) = F J_d − J_d Fᵀ + h S(C s)`, `P = Π + s`, `C = ½ (tr[F] I −
/// Fᵀ)`, `R⁺ = R F`, `P⁺ = Fᵀ P`.
///
/// Let `F exp S(η)` be the rotation for `P + δP` and `s + δs`, and `q = δP − C δs = δΠ + E δs`, `E = I − C`. To first
/// order `η = a = Ξ q` with `Ξ = h D⁻¹`, `D = (tr[F J_d] I − F J_d) F − h (s φᵀ + ½ S(Fᵀ s))`, `φ = ½ (F − Fᵀ)ᵛ`. The
/// second order of `w·η` is `½ aᵀ (Q − tr[Q] I) a + aᵀ (h φ vᵀ + ½ h S(v) Fᵀ) δs` with `v = D⁻ᵀ w`, `Q = J_d S(v) F − ½ h
/// ((v·s) F − v (Fᵀ s)ᵀ)`. The rest is as without wheels, see [`RotationDrift`](super::drift::RotationDrift).
pub(crate) struct GyrostatDrift {
    h: f64,
    /// `F`
    relative: Matrix3<f64>,
    /// `s`
    stored: Vector3<f64>,
    /// `P⁺`
    total: Vector3<f64>,
}

impl GyrostatDrift {
    /// Turns the attitude.
    fn new(body: &RigidBody, h: f64, state: &mut BodyState) -> Result<Self, Unsolvable> {
        let stored = state.linear_momentum;
        let turn = solve_gyrostat(body.inertia(), &stored, h, &state.angular_momentum)?;
        let total = state.angular_momentum + stored;
        let rotation = Quaternion::from_cayley(&turn.cayley);
        let (attitude, total) = rotation.carry(&state.attitude, &total);
        state.attitude = attitude;
        state.angular_momentum = total - stored;
        Ok(Self {
            h,
            relative: turn.matrix(),
            stored,
            total,
        })
    }

    /// `C`
    fn share(&self) -> Matrix3<f64> {
        let trace = Matrix3::from_diagonal_element(self.relative.trace());
        0.5 * (trace - self.relative.transpose())
    }

    /// `φ`
    fn turned(&self) -> Vector3<f64> {
        0.5 * lgvi_lie::vee(&(self.relative - self.relative.transpose()))
    }
}

impl Drift for GyrostatDrift {
    fn gradient(&self, body: &RigidBody) -> Turn {
        let (h, relative) = (self.h, &self.relative);
        let f_jd = relative * body.inertia().nonstandard();
        let b = Matrix3::from_diagonal_element(f_jd.trace()) - f_jd;
        let gyroscopic =
            self.stored * self.turned().transpose() + 0.5 * hat(&relative.tr_mul(&self.stored));
        let d = b * relative - h * gyroscopic;
        let xi = d.try_inverse().unwrap_or_else(Matrix3::zeros) * h;
        let f_t = relative.transpose();
        Turn {
            pose: f_t,
            pose_by_momentum: xi,
            momentum: f_t + hat(&self.total) * xi,
        }
    }

    fn stored_gradient(&self, first: &Turn) -> Option<StoredTurn> {
        let share = self.share();
        let rest = Matrix3::identity() - share;
        Some(StoredTurn {
            pose: first.pose_by_momentum * rest,
            momentum: first.momentum * rest + first.pose * share - Matrix3::identity(),
        })
    }

    fn curvature(
        &self,
        body: &RigidBody,
        first: &Turn,
        third: &Vector3<f64>,
        fourth: &Vector3<f64>,
    ) -> TurnCurvature {
        let (h, relative, s) = (self.h, &self.relative, &self.stored);
        let (xi, j_d) = (&first.pose_by_momentum, body.inertia().nonstandard());
        let xi_t = xi.transpose();
        let v = self.dual(first, third, fourth);
        let stored = v.dot(s) * relative - v * relative.tr_mul(s).transpose();
        let q = j_d * (hat(&v) * relative) - (0.5 * h) * stored + fourth * self.total.transpose();
        let middle = 0.5 * (q + q.transpose()) - Matrix3::from_diagonal_element(q.trace());
        let x = relative * (hat(fourth) * xi);
        TurnCurvature {
            pose_momentum: relative * (hat(&(-0.5 * third)) * xi),
            momentum_momentum: xi_t * (middle * xi) - x - x.transpose(),
        }
    }

    /// With `K = Ξᵀ (h φ vᵀ + ½ h S(v) Fᵀ + S(λ⁴) Fᵀ C)` and those by `q`: `H_ζs = H_ζΠ E`, `H_Πs = H_ΠΠ E + K`, `H_ss = Eᵀ
    /// H_ΠΠ E + Eᵀ K + Kᵀ E`.
    fn stored_curvature(
        &self,
        first: &Turn,
        own: &TurnCurvature,
        third: &Vector3<f64>,
        fourth: &Vector3<f64>,
    ) -> Option<StoredCurvature> {
        let (h, f_t) = (self.h, &first.pose);
        let v = self.dual(first, third, fourth);
        let share = self.share();
        let rest = Matrix3::identity() - share;
        let by_turn = h * self.turned() * v.transpose()
            + (0.5 * h) * hat(&v) * f_t
            + hat(fourth) * f_t * share;
        let cross = first.pose_by_momentum.tr_mul(&by_turn);
        let momentum = own.momentum_momentum * rest;
        let mixed = rest.tr_mul(&cross);
        Some(StoredCurvature {
            pose: own.pose_momentum * rest,
            stored: rest.tr_mul(&momentum) + mixed + mixed.transpose(),
            momentum: momentum + cross,
        })
    }
}

impl GyrostatDrift {
    /// `v = D⁻ᵀ w`, `w = λ³ + λ⁴ × P⁺`.
    fn dual(&self, first: &Turn, third: &Vector3<f64>, fourth: &Vector3<f64>) -> Vector3<f64> {
        let w = third + fourth.cross(&self.total);
        first.pose_by_momentum.tr_mul(&w) / self.h
    }
}
