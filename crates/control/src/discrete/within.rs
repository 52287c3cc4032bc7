//! The motion that a step stands for, between its ends.

use std::sync::Arc;

use lgvi_dynamics::BodyState;
use lgvi_lie::{exp, log, right_jacobian_inverse};
use nalgebra::{Matrix3, Vector3};

use crate::problem::constraint::{cubic, resampled};
use crate::{Dynamics, Transfer};

/// The motion between the states at both ends of a step.
///
/// An LGVI step stands for the cubics with the positions, attitudes and velocities at its ends, which are exact for a
/// constant force; attitudes are cubics of the rotation vector. A Lie–Euler step is a free motion with an impulse at its
/// end: position and rotation vector are linear. Momenta are linear. The position of a transfer by wheels follows the orbit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Within {
    start: BodyState,
    /// Polynomials of the part of the step: displacement and rotation vector.
    displacement: [Vector3<f64>; 3],
    turn: [Vector3<f64>; 3],
    gained: [Vector3<f64>; 2],
    /// The given positions at the ends of all steps, and the index of the step.
    orbit: Option<(Arc<[Vector3<f64>]>, usize)>,
}

impl Within {
    /// The motion in each step of `transfer` between these states.
    pub(crate) fn all(transfer: &Transfer, states: &[BodyState]) -> Vec<Self> {
        let orbit = transfer.orbit.as_ref();
        let orbit = orbit.map(|orbit| resampled(orbit, transfer.intervals));
        let steps = states.windows(2).take(transfer.intervals).enumerate();
        let within = |(step, ends): (usize, &[BodyState])| {
            let orbit = orbit.clone().map(|orbit| (orbit, step));
            Self::new(transfer, orbit, &ends[0], &ends[1])
        };
        steps.map(within).collect()
    }

    fn new(
        transfer: &Transfer,
        orbit: Option<(Arc<[Vector3<f64>]>, usize)>,
        from: &BodyState,
        to: &BodyState,
    ) -> Self {
        let Transfer { body, h, .. } = transfer;
        let turn = log(&from.attitude.tr_mul(&to.attitude));
        let shift = to.position - from.position;
        let linear = |whole| [whole, Vector3::zeros(), Vector3::zeros()];
        let (displacement, turn) = match transfer.dynamics {
            Dynamics::LieEuler => (linear(shift), linear(turn)),
            Dynamics::Lgvi => {
                let [first, last] = [from, to].map(|state| *h * state.angular_velocity(body));
                let last = right_jacobian_inverse(&turn) * last;
                let velocities = [from, to].map(|state| *h * state.velocity(body));
                (hermite(shift, velocities), hermite(turn, [first, last]))
            }
        };
        Self {
            start: *from,
            displacement,
            turn,
            gained: [
                to.linear_momentum - from.linear_momentum,
                to.angular_momentum - from.angular_momentum,
            ],
            orbit,
        }
    }

    /// The state at the end, where the position follows the orbit, if one is given.
    pub(crate) fn end(&self, state: &BodyState) -> BodyState {
        match &self.orbit {
            Some((orbit, step)) => BodyState {
                position: orbit[*step + 1],
                ..*state
            },
            None => *state,
        }
    }

    /// The state at a part of the step, from 0 to 1.
    pub(crate) fn at(&self, part: f64) -> BodyState {
        let polynomial = |[a, b, c]: &[Vector3<f64>; 3]| part * (a + part * (b + part * c));
        let position = match &self.orbit {
            Some((orbit, step)) => {
                let from = orbit[*step];
                from + cubic(orbit, *step, part, |position| position - from)
            }
            None => self.start.position + polynomial(&self.displacement),
        };
        let turn: Matrix3<f64> = exp(&polynomial(&self.turn));
        BodyState {
            position,
            linear_momentum: self.start.linear_momentum + part * self.gained[0],
            attitude: self.start.attitude * turn,
            angular_momentum: self.start.angular_momentum + part * self.gained[1],
        }
    }
}

/// The coefficients of `s`, `s²` and `s³` of the cubic from 0 to `whole` over `s` from 0 to 1, with these slopes at the ends.
fn hermite(whole: Vector3<f64>, [first, last]: [Vector3<f64>; 2]) -> [Vector3<f64>; 3] {
    [
        first,
        3.0 * whole - 2.0 * first - last,
        first + last - 2.0 * whole,
    ]
}
