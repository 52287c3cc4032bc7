//! The coordinates of a body that a plan moves.

use lgvi_dynamics::gravity::Field;
use lgvi_dynamics::rotation::Unsolvable;
use lgvi_dynamics::{BodyState, Load, RigidBody};
use lgvi_lie::exp;
use nalgebra::{Matrix3, SVector, Vector3};

use super::drift::{Drift, RotationDrift};
use super::linear::Blocks;
use crate::problem::{Vector12, block, miss};

/// `N` groups of three coordinates of pose and of momentum, with their drift and their kick by gravity.
pub(crate) trait Coordinates<const N: usize> {
    /// The drift of the last group, if it is the attitude.
    type Drift: Drift;
    /// Whether the first group is the center of mass.
    const GLIDES: bool;
    /// Whether the momentum of the first group is stored in the body, so that it turns the last group.
    const STORES: bool = false;

    /// `state`, with the coordinates that are not planned set to their values at step `k`.
    fn at(&self, k: usize, state: &BodyState) -> BodyState;

    /// Moves `state` from step `k` to the next by the free motion over `h`, through air of a factor times its density. Returns
    /// the rotation, if the last group is the attitude.
    fn drift(
        &self,
        k: usize,
        body: &RigidBody,
        over: [f64; 2],
        state: &mut BodyState,
    ) -> Result<Option<Self::Drift>, Unsolvable>;

    /// Adds impulses to the momenta.
    fn kick(&self, impulses: &[Vector3<f64>; N], state: &mut BodyState);

    /// The loads of gravity.
    fn load(&self, field: &dyn Field, body: &RigidBody, state: &BodyState) -> [Vector3<f64>; N];

    /// The first derivatives of these loads by the pose.
    fn gradient(&self, field: &dyn Field, body: &RigidBody, state: &BodyState) -> Blocks;

    /// The symmetric second derivatives of the product of these loads and `weights`.
    fn curvature(
        &self,
        field: &dyn Field,
        body: &RigidBody,
        state: &BodyState,
        weights: &[Vector3<f64>; N],
    ) -> Blocks;

    /// Sets the momentum that the body stores, which a path of poses does not give, in states along it. The first is the
    /// initial one.
    fn complete(&self, _states: &mut [BodyState]) {}
}

/// Variations `z` of states, as in [`DiscreteDynamics::difference`](super::DiscreteDynamics::difference) and
/// [`DiscreteDynamics::moved`](super::DiscreteDynamics::moved).
pub(crate) trait Variations<const X: usize> {
    fn difference(&self, from: &BodyState, to: &BodyState) -> SVector<f64, X>;

    fn moved(&self, state: &BodyState, z: &SVector<f64, X>) -> BodyState;
}

/// Position and attitude.
pub(crate) struct Full;

impl Coordinates<2> for Full {
    type Drift = RotationDrift;
    const GLIDES: bool = true;

    #[inline(always)]
    fn at(&self, _k: usize, state: &BodyState) -> BodyState {
        *state
    }

    #[inline(always)]
    fn drift(
        &self,
        _k: usize,
        body: &RigidBody,
        [h, density]: [f64; 2],
        state: &mut BodyState,
    ) -> Result<Option<RotationDrift>, Unsolvable> {
        body.glide(state, h, density);
        RotationDrift::new(body, h, state).map(Some)
    }

    fn kick(&self, [force, moment]: &[Vector3<f64>; 2], state: &mut BodyState) {
        state.linear_momentum += force;
        state.angular_momentum += moment;
    }

    fn load(&self, field: &dyn Field, body: &RigidBody, state: &BodyState) -> [Vector3<f64>; 2] {
        let load = field.load(body, &state.position, &state.attitude);
        [load.force, load.moment]
    }

    fn gradient(&self, field: &dyn Field, body: &RigidBody, state: &BodyState) -> Blocks {
        let g = field.gradient(body, &state.position, &state.attitude);
        [
            [g.force_by_position, g.force_by_attitude],
            [g.moment_by_position, g.moment_by_attitude],
        ]
    }

    fn curvature(
        &self,
        field: &dyn Field,
        body: &RigidBody,
        state: &BodyState,
        &[force, moment]: &[Vector3<f64>; 2],
    ) -> Blocks {
        let weights = Load { force, moment };
        let k = field.curvature(body, &state.position, &state.attitude, &weights);
        let mixed = k.position_attitude;
        [
            [k.position_position, mixed],
            [mixed.transpose(), symmetric(&k.attitude_attitude)],
        ]
    }
}

/// The second derivative along one exponential, from a derivative by two successive rotations: `½ (H_RR + H_RRᵀ)`.
#[inline]
pub(crate) fn symmetric(h_rr: &Matrix3<f64>) -> Matrix3<f64> {
    0.5 * (h_rr + h_rr.transpose())
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
