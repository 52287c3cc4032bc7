//! One Lie–Euler step in the necessary conditions: its kinematics, linearization and adjoint, by 3×3 blocks.
//!
//! With `B = tr[F J_d] I − F J_d` the variations of the step are (`ζ⁺` and the like at the end of the step) `δx⁺ = δx +
//! (h/m) δγ`, `ζ⁺ = Fᵀ ζ + Ξ`, `Ξ = h Fᵀ B⁻¹ δΠ`, `δγ⁺ = δγ + h (F_x δx⁺ + F_R ζ⁺) + h δuᶠ`, `δΠ⁺ = Fᵀ δΠ + S(Fᵀ Π) Ξ +
//! h (M_x δx⁺ + M_R ζ⁺) + h δuᵐ`. This is the matrix `A` of the linearized equations, which is never formed.
//!
//! The multiplier equation `μ = Aᵀ λ` (4.26) is solved for λ block by block, with one 3×3 solve: with `y = F λ⁴`, `λ² =
//! μ² − (h/m) μ¹`, `(Bᵀ − h S(Π)) y = Bᵀ μ⁴ − h μ³`, `λ¹ = μ¹ − h p`, `λ³ = Fᵀ μ³ − h q`, `p = F_xᵀ λ² + M_xᵀ λ⁴`, `q =
//! F_Rᵀ λ² + M_Rᵀ λ⁴`.

use lgvi_dynamics::gravity::LoadGradient;
use lgvi_dynamics::rotation::{self, Unsolvable};
use lgvi_dynamics::{BodyState, Load};
use lgvi_lie::{compose, hat, rotate_back};
use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::Transfer;
use crate::problem::{Vector12, block};

/// Derivatives of a 3-vector by the twelve initial multipliers.
pub(crate) type Rows = SMatrix<f64, 3, 12>;

/// Derivatives of the state and of the multipliers by the twelve initial multipliers.
#[derive(Clone, Debug)]
pub(crate) struct Sensitivity {
    /// `[δx, δγ, ζ, δΠ]`
    pub(crate) state: [Rows; 4],
    /// `δλ`
    pub(crate) multipliers: [Rows; 4],
}

impl Sensitivity {
    /// The sensitivity at the start: the state is fixed, the multipliers are the unknowns themselves.
    pub(crate) fn initial() -> Self {
        let unit = |which: usize| {
            let mut rows = Rows::zeros();
            rows.fixed_view_mut::<3, 3>(0, 3 * which)
                .fill_with_identity();
            rows
        };
        Self {
            state: [Rows::zeros(); 4],
            multipliers: [unit(0), unit(1), unit(2), unit(3)],
        }
    }
}

/// The quantities of a step from `state` that do not depend on its control.
pub(crate) struct Step<'t> {
    transfer: &'t Transfer,
    /// `W_f⁻¹` and `W_m⁻¹`
    gains: &'t [Matrix3<f64>; 2],
    state: BodyState,
    /// The Cayley vector of `F`.
    turn: Vector3<f64>,
    /// `F`
    relative: Matrix3<f64>,
    next_position: Vector3<f64>,
    next_attitude: Matrix3<f64>,
    gravity: Load,
    gradient: LoadGradient,
    /// `B`
    b: Matrix3<f64>,
    /// `(Bᵀ − h S(Π))⁻¹` of the multiplier equation.
    adjoint: Matrix3<f64>,
}

impl<'t> Step<'t> {
    /// The step from `state`: (4.19), (4.21), (4.22) and gravity at its end.
    pub(crate) fn new(
        transfer: &'t Transfer,
        gains: &'t [Matrix3<f64>; 2],
        state: BodyState,
    ) -> Result<Self, Unsolvable> {
        let body = &transfer.body;
        let g = transfer.h * state.angular_momentum;
        let turn = rotation::solve(body.inertia(), &g)?;
        let relative = turn.matrix();
        let next_position = state.position + (transfer.h / body.mass()) * state.linear_momentum;
        let next_attitude = compose(&state.attitude, &turn.cayley);
        let f_jd = relative * body.inertia().nonstandard();
        let b = Matrix3::from_diagonal_element(f_jd.trace()) - f_jd;
        let adjoint = inverse(&(b.transpose() - transfer.h * hat(&state.angular_momentum)));
        Ok(Self {
            transfer,
            gains,
            state,
            turn: turn.cayley,
            relative,
            next_position,
            next_attitude,
            gravity: transfer.field.load(body, &next_position, &next_attitude),
            gradient: transfer
                .field
                .gradient(body, &next_position, &next_attitude),
            b,
            adjoint,
        })
    }

    /// The state after the step with `control`: (4.20), (4.23).
    pub(crate) fn next(&self, control: &Load) -> BodyState {
        let h = self.transfer.h;
        let load = self.gravity + *control;
        BodyState {
            position: self.next_position,
            linear_momentum: self.state.linear_momentum + h * load.force,
            attitude: self.next_attitude,
            angular_momentum: rotate_back(&self.turn, &self.state.angular_momentum)
                + h * load.moment,
        }
    }

    /// `A⁻ᵀ μ`: the multipliers of this step from those of the previous step (4.26). Not finite if `A` is singular.
    pub(crate) fn multipliers(&self, previous: &Vector12) -> Vector12 {
        let h = self.transfer.h;
        let mu: [Vector3<f64>; 4] = std::array::from_fn(|which| block(previous, which));
        let second = mu[1] - (h / self.transfer.body.mass()) * mu[0];
        let fourth = self
            .relative
            .tr_mul(&(self.adjoint * (self.b.tr_mul(&mu[3]) - h * mu[2])));
        let g = &self.gradient;
        let p = g.force_by_position.tr_mul(&second) + g.moment_by_position.tr_mul(&fourth);
        let q = g.force_by_attitude.tr_mul(&second) + g.moment_by_attitude.tr_mul(&fourth);
        let first = mu[0] - h * p;
        let third = self.relative.tr_mul(&mu[2]) - h * q;
        let mut lambda = Vector12::zeros();
        for (which, part) in [first, second, third, fourth].iter().enumerate() {
            lambda.fixed_rows_mut::<3>(3 * which).copy_from(part);
        }
        lambda
    }

    /// `δx⁺`, `ζ⁺` and `Ξ` for the sensitivity of the state.
    fn kinematics(&self, z: &[Rows; 4]) -> (Rows, Rows, Rows) {
        let h = self.transfer.h;
        let xi = self.relative.transpose() * (h * inverse(&self.b)) * z[3];
        let position = z[0] + (h / self.transfer.body.mass()) * z[1];
        let attitude = self.relative.transpose() * z[2] + xi;
        (position, attitude, xi)
    }

    /// Differentiates the step: [`Step::next`] and, if `before` holds the multipliers of the previous step,
    /// [`Step::multipliers`].
    pub(crate) fn vary(
        &self,
        before: Option<&Vector12>,
        lambda: &Vector12,
        sensitivity: &mut Sensitivity,
    ) {
        let moved = self.kinematics(&sensitivity.state);
        if let Some(previous) = before {
            self.vary_multipliers(previous, lambda, &moved, sensitivity);
        }
        self.vary_state(moved, sensitivity);
    }

    /// Differentiates [`Step::multipliers`]: replaces the sensitivity of `previous` by that of `lambda`, for the
    /// sensitivity of the state at the start of the step.
    fn vary_multipliers(
        &self,
        previous: &Vector12,
        lambda: &Vector12,
        (position, attitude, xi): &(Rows, Rows, Rows),
        sensitivity: &mut Sensitivity,
    ) {
        let (h, transfer) = (self.transfer.h, self.transfer);
        let f_t = self.relative.transpose();
        let [mu, lambda]: [[Vector3<f64>; 4]; 2] =
            [previous, lambda].map(|v| std::array::from_fn(|which| block(v, which)));
        let delta_mu = &sensitivity.multipliers;

        let second = delta_mu[1] - (h / transfer.body.mass()) * delta_mu[0];

        // δB = tr[F S(Ξ) J_d] I − F S(Ξ) J_d, transposed and applied to w = μ⁴ − y.
        let j_d = transfer.body.inertia().nonstandard();
        let y = self.relative * lambda[3];
        let w = mu[3] - y;
        let jf = j_d * self.relative;
        let c = Vector3::new(
            jf[(2, 1)] - jf[(1, 2)],
            jf[(0, 2)] - jf[(2, 0)],
            jf[(1, 0)] - jf[(0, 1)],
        );
        let b_varied = -(w * c.transpose() + j_d * hat(&(f_t * w)));
        let right = self.b.transpose() * delta_mu[3] - h * delta_mu[2] + b_varied * xi
            - h * hat(&y) * sensitivity.state[3];
        let fourth = f_t * (self.adjoint * right) + hat(&lambda[3]) * xi;

        let weights = Load {
            force: lambda[1],
            moment: lambda[3],
        };
        let k = transfer.field.curvature(
            &transfer.body,
            &self.next_position,
            &self.next_attitude,
            &weights,
        );
        let g = &self.gradient;
        let p = k.position_position * position
            + k.position_attitude * attitude
            + g.force_by_position.transpose() * second
            + g.moment_by_position.transpose() * fourth;
        let q = k.position_attitude.transpose() * position
            + k.attitude_attitude * attitude
            + g.force_by_attitude.transpose() * second
            + g.moment_by_attitude.transpose() * fourth;
        let first = delta_mu[0] - h * p;
        let third = f_t * delta_mu[2] + hat(&(f_t * mu[2])) * xi - h * q;
        sensitivity.multipliers = [first, second, third, fourth];
    }

    /// Differentiates [`Step::next`], with the control given by the sensitivity's multipliers.
    fn vary_state(
        &self,
        (position, attitude, xi): (Rows, Rows, Rows),
        sensitivity: &mut Sensitivity,
    ) {
        let h = self.transfer.h;
        let [force_gain, moment_gain] = self.gains;
        let f_t = self.relative.transpose();
        let [_, gamma, _, pi] = &sensitivity.state;
        let g = &self.gradient;
        let momentum = gamma
            + h * (g.force_by_position * position + g.force_by_attitude * attitude
                - force_gain * sensitivity.multipliers[1]);
        let angular = f_t * pi
            + hat(&(f_t * self.state.angular_momentum)) * xi
            + h * (g.moment_by_position * position + g.moment_by_attitude * attitude
                - moment_gain * sensitivity.multipliers[3]);
        sensitivity.state = [position, momentum, attitude, angular];
    }
}

/// The inverse of `m`; not finite if `m` is singular.
pub(crate) fn inverse(m: &Matrix3<f64>) -> Matrix3<f64> {
    m.try_inverse()
        .unwrap_or_else(|| Matrix3::from_element(f64::NAN))
}

#[cfg(test)]
mod tests;
