//! The turn of one body over a drift, by each kind of rotor.

use lgvi_lie::Quaternion;
use nalgebra::{Matrix3, Vector3};

use super::turn::Known;
use crate::rotation::{
    Chart, Direct, FreeRotation, General, Moments, PreprocessedDmv, PreprocessedError,
    RelativeRotation,
};
use crate::{BodyState, Inertia};

/// How a body's rotation over a drift is found.
pub(super) trait Turn {
    /// Sets `next` to `R F` and `Fᵀ p` of the turn by `h` from attitude R and angular momentum p, if it is found at once.
    fn carry(
        &self,
        _from: (&Matrix3<f64>, &Vector3<f64>),
        _h: f64,
        _known: &mut Known,
        _next: &mut BodyState,
    ) -> bool {
        false
    }

    /// The turn whatever it takes.
    fn solve(
        &self,
        inertia: &Inertia,
        h: f64,
        p: &Vector3<f64>,
        guess: f64,
    ) -> Result<Solved, PreprocessedError>;
}

/// A turn, the Newton corrections it took, and what the next guess builds on.
pub(super) struct Solved {
    pub(super) turn: Quaternion,
    pub(super) iterations: u32,
    pub(super) s: f64,
}

impl From<(RelativeRotation, f64)> for Solved {
    fn from((found, s): (RelativeRotation, f64)) -> Self {
        Self {
            turn: Quaternion::from_cayley(&found.cayley),
            iterations: found.iterations,
            s,
        }
    }
}

impl<M: Moments> Turn for Direct<M> {
    #[inline(always)]
    fn carry(
        &self,
        (r, p): (&Matrix3<f64>, &Vector3<f64>),
        h: f64,
        known: &mut Known,
        next: &mut BodyState,
    ) -> bool {
        let Some((turn, s)) = self.solve(h, p, known.guess()) else {
            return false;
        };
        known.note(s);
        (next.attitude, next.angular_momentum) = turn.carry(r, p);
        true
    }

    fn solve(
        &self,
        inertia: &Inertia,
        h: f64,
        p: &Vector3<f64>,
        guess: f64,
    ) -> Result<Solved, PreprocessedError> {
        Ok(self.solve_on(inertia, h, p, guess)?.into())
    }
}

impl Turn for (Chart, Direct<General>) {
    fn solve(
        &self,
        inertia: &Inertia,
        h: f64,
        p: &Vector3<f64>,
        guess: f64,
    ) -> Result<Solved, PreprocessedError> {
        let (chart, equation) = self;
        Ok(equation.solve_in(*chart, inertia, h, p, guess)?.into())
    }
}

impl Turn for PreprocessedDmv {
    fn solve(
        &self,
        _: &Inertia,
        h: f64,
        p: &Vector3<f64>,
        _: f64,
    ) -> Result<Solved, PreprocessedError> {
        Ok((self.step(p, h)?, 0.0).into())
    }
}

impl Turn for FreeRotation {
    #[inline(always)]
    fn carry(
        &self,
        (r, p): (&Matrix3<f64>, &Vector3<f64>),
        h: f64,
        _: &mut Known,
        next: &mut BodyState,
    ) -> bool {
        self.carry(r, p, h, (&mut next.attitude, &mut next.angular_momentum));
        true
    }

    fn solve(
        &self,
        _: &Inertia,
        h: f64,
        p: &Vector3<f64>,
        _: f64,
    ) -> Result<Solved, PreprocessedError> {
        let (turn, _) = self.flow(p, h);
        Ok(Solved {
            turn,
            iterations: 0,
            s: 0.0,
        })
    }
}
