//! The rotation of one body over a drift, for each kind of rotor.

use lgvi_lie::Quaternion;
use nalgebra::{Matrix3, Vector3};

use super::warm_start::Solutions;
use crate::BodyState;
use crate::rotation::{DiscreteRotation, FreeRotation, Solved, Unsolvable};

/// The computation of a body's rotation over a drift.
pub(super) trait BodyRotation {
    /// Sets `next` to `R F` and `Fᵀ p` for the rotation over `h` from attitude R and angular momentum p. Returns false
    /// if the first pass does not find the rotation.
    fn carry(
        &self,
        from: (&Matrix3<f64>, &Vector3<f64>),
        h: f64,
        solutions: &mut Solutions<f64>,
        next: &mut BodyState,
    ) -> bool;

    /// Solves for the rotation with as many iterations as needed.
    fn find(&self, h: f64, p: &Vector3<f64>, guess: f64) -> Result<Solved, Unsolvable>;
}

impl BodyRotation for DiscreteRotation<f64> {
    #[inline(always)]
    fn carry(
        &self,
        (r, p): (&Matrix3<f64>, &Vector3<f64>),
        h: f64,
        solutions: &mut Solutions<f64>,
        next: &mut BodyState,
    ) -> bool {
        let Some((rotation, correction)) = self.first_pass(h, p, solutions.extrapolate()) else {
            return false;
        };
        solutions.note(correction);
        (next.attitude, next.angular_momentum) = rotation.carry(r, p);
        true
    }

    fn find(&self, h: f64, p: &Vector3<f64>, guess: f64) -> Result<Solved, Unsolvable> {
        self.find(h, p, guess)
    }
}

impl BodyRotation for FreeRotation {
    #[inline(always)]
    fn carry(
        &self,
        (r, p): (&Matrix3<f64>, &Vector3<f64>),
        h: f64,
        _: &mut Solutions<f64>,
        next: &mut BodyState,
    ) -> bool {
        self.carry(r, p, h, (&mut next.attitude, &mut next.angular_momentum));
        true
    }

    fn find(&self, h: f64, p: &Vector3<f64>, _: f64) -> Result<Solved, Unsolvable> {
        let (rotation, _): (Quaternion, _) = self.flow(p, h);
        Ok(Solved {
            rotation,
            correction: 0.0,
            iterations: 0,
        })
    }
}
