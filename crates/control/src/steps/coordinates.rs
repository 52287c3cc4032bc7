//! Which coordinates of a body a plan moves.

use lgvi_dynamics::gravity::Field;
use lgvi_dynamics::rotation::Unsolvable;
use lgvi_dynamics::{BodyState, Load, RigidBody};
use lgvi_lie::exp;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::drift::{DriftCurvature, DriftGradient, Turn, glide};
use crate::problem::{Vector12, block, miss};

/// `P` coordinates of pose and as many of momentum: how a drift moves them and how gravity kicks them.
pub(crate) trait Coordinates<const P: usize> {
    /// What a drift keeps for its second derivatives.
    type Drift;

    /// `state`, with the coordinates that do not move where they are at step `k`.
    fn at(&self, k: usize, state: &BodyState) -> BodyState;

    /// Moves `state` from step `k` to the next by the free motion over `h`.
    fn drift(
        &self,
        k: usize,
        body: &RigidBody,
        h: f64,
        state: &mut BodyState,
    ) -> Result<Self::Drift, Unsolvable>;

    fn drift_gradient(&self, body: &RigidBody, h: f64, drift: &Self::Drift) -> DriftGradient<P>;

    /// Of `pose·δpose + momentum·δmomentum` after the drift.
    fn drift_curvature(
        &self,
        drift: &Self::Drift,
        gradient: &DriftGradient<P>,
        pose: &SVector<f64, P>,
        momentum: &SVector<f64, P>,
    ) -> DriftCurvature<P>;

    /// Adds an impulse.
    fn kick(&self, impulse: &SVector<f64, P>, state: &mut BodyState);

    /// What gravity exerts.
    fn load<F: Field>(&self, field: &F, body: &RigidBody, state: &BodyState) -> SVector<f64, P>;

    /// Its first derivatives by the pose.
    fn gradient<F: Field>(
        &self,
        field: &F,
        body: &RigidBody,
        state: &BodyState,
    ) -> SMatrix<f64, P, P>;

    /// Second derivatives of its product with `weights`, symmetric.
    fn curvature<F: Field>(
        &self,
        field: &F,
        body: &RigidBody,
        state: &BodyState,
        weights: &SVector<f64, P>,
    ) -> SMatrix<f64, P, P>;
}

/// States as variations `z` of others, [`Steps::difference`](super::Steps::difference) and
/// [`Steps::moved`](super::Steps::moved).
pub(crate) trait Variations<const X: usize> {
    fn difference(&self, from: &BodyState, to: &BodyState) -> SVector<f64, X>;

    fn moved(&self, state: &BodyState, z: &SVector<f64, X>) -> BodyState;
}

/// Position and attitude.
pub(crate) struct Full;

fn first(v: &SVector<f64, 6>) -> Vector3<f64> {
    v.fixed_rows::<3>(0).into_owned()
}

fn second(v: &SVector<f64, 6>) -> Vector3<f64> {
    v.fixed_rows::<3>(3).into_owned()
}

fn blocks([[a, b], [c, d]]: [[&Matrix3<f64>; 2]; 2]) -> SMatrix<f64, 6, 6> {
    let mut all = SMatrix::<f64, 6, 6>::zeros();
    all.fixed_view_mut::<3, 3>(0, 0).copy_from(a);
    all.fixed_view_mut::<3, 3>(0, 3).copy_from(b);
    all.fixed_view_mut::<3, 3>(3, 0).copy_from(c);
    all.fixed_view_mut::<3, 3>(3, 3).copy_from(d);
    all
}

/// The translation's block, then the rotation's.
fn diagonal(translation: &Matrix3<f64>, rotation: &Matrix3<f64>) -> SMatrix<f64, 6, 6> {
    let zero = Matrix3::zeros();
    blocks([[translation, &zero], [&zero, rotation]])
}

fn symmetric(m: &Matrix3<f64>) -> Matrix3<f64> {
    0.5 * (m + m.transpose())
}

impl Coordinates<6> for Full {
    type Drift = Turn;

    fn at(&self, _k: usize, state: &BodyState) -> BodyState {
        *state
    }

    fn drift(
        &self,
        _k: usize,
        body: &RigidBody,
        h: f64,
        state: &mut BodyState,
    ) -> Result<Turn, Unsolvable> {
        let turn = Turn::new(body, h, &state.angular_momentum)?;
        state.position = glide(body, h, state);
        turn.apply(state);
        Ok(turn)
    }

    fn drift_gradient(&self, body: &RigidBody, h: f64, turn: &Turn) -> DriftGradient<6> {
        let rotation = turn.gradient();
        let unit = Matrix3::identity();
        let glide = Matrix3::from_diagonal_element(h / body.mass());
        DriftGradient {
            pose_by_pose: diagonal(&unit, &rotation.pose_by_pose),
            pose_by_momentum: diagonal(&glide, &rotation.pose_by_momentum),
            momentum_by_momentum: diagonal(&unit, &rotation.momentum_by_momentum),
        }
    }

    fn drift_curvature(
        &self,
        turn: &Turn,
        gradient: &DriftGradient<6>,
        pose: &SVector<f64, 6>,
        momentum: &SVector<f64, 6>,
    ) -> DriftCurvature<6> {
        let rotation = DriftGradient {
            pose_by_pose: gradient.pose_by_pose.fixed_view::<3, 3>(3, 3).into_owned(),
            pose_by_momentum: gradient
                .pose_by_momentum
                .fixed_view::<3, 3>(3, 3)
                .into_owned(),
            momentum_by_momentum: gradient
                .momentum_by_momentum
                .fixed_view::<3, 3>(3, 3)
                .into_owned(),
        };
        let rotation = turn.curvature(&rotation, &second(pose), &second(momentum));
        let zero = Matrix3::zeros();
        DriftCurvature {
            pose_momentum: diagonal(&zero, &rotation.pose_momentum),
            momentum_momentum: diagonal(&zero, &rotation.momentum_momentum),
        }
    }

    fn kick(&self, impulse: &SVector<f64, 6>, state: &mut BodyState) {
        state.linear_momentum += first(impulse);
        state.angular_momentum += second(impulse);
    }

    fn load<F: Field>(&self, field: &F, body: &RigidBody, state: &BodyState) -> SVector<f64, 6> {
        let load = field.load(body, &state.position, &state.attitude);
        SVector::from_iterator(load.force.iter().chain(&load.moment).copied())
    }

    fn gradient<F: Field>(
        &self,
        field: &F,
        body: &RigidBody,
        state: &BodyState,
    ) -> SMatrix<f64, 6, 6> {
        let g = field.gradient(body, &state.position, &state.attitude);
        blocks([
            [&g.force_by_position, &g.force_by_attitude],
            [&g.moment_by_position, &g.moment_by_attitude],
        ])
    }

    /// `H_RR` is a derivative in a moving frame; along one exponential only its symmetric part counts.
    fn curvature<F: Field>(
        &self,
        field: &F,
        body: &RigidBody,
        state: &BodyState,
        weights: &SVector<f64, 6>,
    ) -> SMatrix<f64, 6, 6> {
        let weights = Load {
            force: first(weights),
            moment: second(weights),
        };
        let k = field.curvature(body, &state.position, &state.attitude, &weights);
        blocks([
            [&k.position_position, &k.position_attitude],
            [
                &k.position_attitude.transpose(),
                &symmetric(&k.attitude_attitude),
            ],
        ])
    }
}

impl Variations<12> for Full {
    fn difference(&self, from: &BodyState, to: &BodyState) -> Vector12 {
        miss(from, to)
    }

    fn moved(&self, state: &BodyState, z: &Vector12) -> BodyState {
        BodyState {
            position: state.position + block(z, 0),
            linear_momentum: state.linear_momentum + block(z, 1),
            attitude: state.attitude * exp(&block(z, 2)),
            angular_momentum: state.angular_momentum + block(z, 3),
        }
    }
}
