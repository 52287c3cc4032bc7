//! Variations that turn with the body.
//!
//! Momentum and moment are vectors in the body frame. The attitude may move by a large ζ, for example about the axis of
//! a slender body, where this costs next to nothing. The vectors then keep their direction in space only if their
//! components turn back: `exp(−S(ζ)) (Π + δΠ + ζ × Π)` agrees with `Π + δΠ` to first order and remains valid for large
//! variations.

use lgvi_lie::{exp, hat};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Positions of the attitude among the coordinates and of the moment among the commands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyFrame {
    /// Index of ζ; Π begins three later.
    pub(crate) attitude: usize,
    /// Index of the moment. The commands must be moments themselves.
    pub(crate) moment: usize,
}

impl BodyFrame {
    /// Replaces δΠ in the difference `z` of two states by that of turned variations from the momentum `from` to the
    /// momentum `to`. Returns ζ.
    pub(crate) fn difference<const X: usize>(
        self,
        from: &Vector3<f64>,
        to: &Vector3<f64>,
        z: &mut SVector<f64, X>,
    ) -> Vector3<f64> {
        let zeta = z.fixed_rows::<3>(self.attitude).into_owned();
        let turned = exp(&zeta) * to - from - zeta.cross(from);
        z.fixed_rows_mut::<3>(self.attitude + 3).copy_from(&turned);
        zeta
    }

    /// Turns the moment of `command`, varied from that of the command `from`, with an attitude that has moved by ζ.
    pub(crate) fn command<const U: usize>(
        self,
        zeta: &Vector3<f64>,
        from: &SVector<f64, U>,
        command: &mut SVector<f64, U>,
    ) {
        let before = from.fixed_rows::<3>(self.moment).into_owned();
        let varied = command.fixed_rows::<3>(self.moment) + zeta.cross(&before);
        command
            .fixed_rows_mut::<3>(self.moment)
            .copy_from(&(exp(&-zeta) * varied));
    }

    /// Adds the second derivatives of turned variations, which count where the gradient of the Lagrangian by the command
    /// is nonzero: those of `−r · (ζ × v + ½ ζ × (ζ × u))`.
    pub(crate) fn curve<const X: usize, const U: usize>(
        self,
        gradient: &SVector<f64, U>,
        command: &SVector<f64, U>,
        state: &mut SMatrix<f64, X, X>,
        mixed: &mut SMatrix<f64, U, X>,
    ) {
        let r = gradient.fixed_rows::<3>(self.moment).into_owned();
        let u = command.fixed_rows::<3>(self.moment).into_owned();
        let outer = r * u.transpose();
        let by_attitude =
            Matrix3::from_diagonal_element(r.dot(&u)) - 0.5 * (outer + outer.transpose());
        let mut state = state.fixed_view_mut::<3, 3>(self.attitude, self.attitude);
        state += by_attitude;
        let mut mixed = mixed.fixed_view_mut::<3, 3>(self.moment, self.attitude);
        mixed -= hat(&r);
    }
}
