//! The free rotation of a rigid body in closed form: exact for any time, at a cost independent of the time.

mod asymmetric;
mod attitude;
mod axisymmetric;
mod elliptic;
mod lanes;
mod polhode;
mod third;

use lgvi_lie::Quaternion;
use nalgebra::{Matrix3, Vector3};

use self::asymmetric::Asymmetric;
use self::axisymmetric::Axisymmetric;
use crate::Inertia;

pub(crate) use lanes::FreeRotations;

/// The flow of the free rotation `Ṙ = R S(J⁻¹Π)`, `Π̇ = Π × J⁻¹Π` of one body.
///
/// The formulas depend on the principal moments: one rotation for three equal moments, two rotations for two equal
/// ones, and Jacobi's elliptic functions with an elliptic integral of the third kind for three different ones. Moments
/// count as equal if they differ by less than rounding, 4 × 2⁻⁵² of the largest. Just above that threshold, the
/// formulas for three different moments are equally accurate.
///
/// # Assumptions and limitations
///
/// - The error is the rounding of the state plus the rounding of the phase, about `2⁻⁵² |Π| t/J` rad with the smallest
///   moment J. Beyond a phase of about 1e15 rad the result is meaningless, and beyond 1e150 it is NaN.
/// - On an orbit near the separatrix, the phase is as sensitive to Π as the motion of the body itself.
/// - The inertia of a long rod in axes other than its own determines the small moment only to 2⁻⁵² of the large ones,
///   which limits the accuracy of the spin about it.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeRotation {
    symmetry: Symmetry,
}

#[derive(Clone, Debug, PartialEq)]
enum Symmetry {
    Spherical { moment: f64 },
    Axisymmetric(Axisymmetric),
    Asymmetric(Asymmetric),
}

/// Moments are equal if they differ by at most this fraction of the largest.
const EQUAL: f64 = 4.0 * f64::EPSILON;

impl FreeRotation {
    /// Creates the flow, using the principal axes. Those of a diagonal inertia are the body axes.
    pub fn new(inertia: &Inertia) -> Self {
        let (moments, axes) = principal(inertia);
        let [least, middle, greatest] = moments;
        let equal = |a: f64, b: f64| b - a <= EQUAL * greatest;
        let symmetry = if equal(least, greatest) {
            Symmetry::Spherical { moment: middle }
        } else if equal(least, middle) {
            let transverse = least + 0.5 * (middle - least);
            Symmetry::Axisymmetric(Axisymmetric::new(
                axes.column(2).into(),
                greatest,
                transverse,
            ))
        } else if equal(middle, greatest) {
            let transverse = middle + 0.5 * (greatest - middle);
            Symmetry::Axisymmetric(Axisymmetric::new(axes.column(0).into(), least, transverse))
        } else {
            Symmetry::Asymmetric(Asymmetric::new(moments, axes))
        };
        Self { symmetry }
    }

    /// The relative rotation `F(t)`, with `R(t) = R(0) F(t)`, and the momentum `Π(t) = F(t)ᵀ Π(0)` in the body frame
    /// after a time t of either sign. `pi` is the momentum at time 0.
    #[inline]
    pub fn flow(&self, pi: &Vector3<f64>, t: f64) -> (Quaternion, Vector3<f64>) {
        match &self.symmetry {
            Symmetry::Spherical { moment } => {
                (Quaternion::from_rotation_vector(&(pi * (t / moment))), *pi)
            }
            Symmetry::Axisymmetric(body) => body.flow(pi, t),
            Symmetry::Asymmetric(body) => body.flow(pi, t),
        }
    }

    /// Sets `end` to `R F(t)` and `Π(t)`.
    #[inline(always)]
    pub(crate) fn carry(
        &self,
        r: &Matrix3<f64>,
        pi: &Vector3<f64>,
        t: f64,
        end: (&mut Matrix3<f64>, &mut Vector3<f64>),
    ) {
        if let Symmetry::Axisymmetric(body) = &self.symmetry
            && let Some(axis) = body.coordinate()
        {
            let (turn, pi) = body.flow_about(axis, pi, t);
            *end.0 = turn.compose_unit(r);
            *end.1 = pi;
        } else {
            self.carry_any(r, *pi, t, end);
        }
    }

    /// Takes Π by value. A reference would force it into memory on the other path too.
    #[inline(never)]
    fn carry_any(
        &self,
        r: &Matrix3<f64>,
        pi: Vector3<f64>,
        t: f64,
        end: (&mut Matrix3<f64>, &mut Vector3<f64>),
    ) {
        let (turn, pi) = self.flow(&pi, t);
        *end.0 = turn.compose(r);
        *end.1 = pi;
    }
}

/// Principal moments in ascending order, and a right-handed triad of their axes as columns.
fn principal(inertia: &Inertia) -> ([f64; 3], Matrix3<f64>) {
    let moments = &inertia.principal.moments;
    let axes = inertia.principal.axes.unwrap_or_else(Matrix3::identity);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| moments[i].total_cmp(&moments[j]));
    let mut axes = Matrix3::from_columns(&order.map(|i| axes.column(i).into_owned()));
    if axes.determinant() < 0.0 {
        axes.column_mut(1).neg_mut();
    }
    (order.map(|i| moments[i]), axes)
}

#[cfg(test)]
mod references;
#[cfg(test)]
mod tests;
