use lgvi_lie::{Quaternion, cos_sinc_pair};
use nalgebra::{Vector2, Vector3};

/// A body with two equal moments: `F = exp(S(Π) t/J_t) exp(S(e) (1/J_a − 1/J_t) eᵀΠ t)`, where e is the axis of
/// symmetry, and `J_a` and `J_t` are the axial and transverse moments.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axisymmetric {
    pub(super) axis: Vector3<f64>,
    /// Index of the body axis that equals `axis`, if any.
    coordinate: Option<usize>,
    /// `1/J_t`.
    pub(super) precession_rate: f64,
    /// `1/J_a − 1/J_t`.
    pub(super) spin_rate: f64,
}

impl Axisymmetric {
    pub(super) fn new(axis: Vector3<f64>, axial: f64, transverse: f64) -> Self {
        Self {
            coordinate: (0..3).find(|&i| axis == Vector3::ith(i, 1.0)),
            axis,
            precession_rate: transverse.recip(),
            spin_rate: (transverse - axial) / transverse / axial,
        }
    }

    #[inline]
    pub(super) fn flow(&self, pi: &Vector3<f64>, t: f64) -> (Quaternion, Vector3<f64>) {
        match self.coordinate {
            Some(axis) => self.flow_about(axis, pi, t),
            None => self.flow_about_any(pi, t),
        }
    }

    /// The index of the body axis that is the axis of symmetry, if any.
    #[inline(always)]
    pub(super) fn coordinate(&self) -> Option<usize> {
        self.coordinate
    }

    /// The flow if the axis of symmetry is a body axis. The quaternion has length 1 to rounding.
    #[inline(always)]
    pub(super) fn flow_about(
        &self,
        axis: usize,
        pi: &Vector3<f64>,
        t: f64,
    ) -> (Quaternion, Vector3<f64>) {
        match axis {
            0 => self.flow_about_axis::<0>(pi, t),
            1 => self.flow_about_axis::<1>(pi, t),
            _ => self.flow_about_axis::<2>(pi, t),
        }
    }

    /// The flow about a coordinate axis: the quaternion of the spin has one vector component, and Π rotates in a plane.
    #[inline(always)]
    fn flow_about_axis<const AXIS: usize>(
        &self,
        pi: &Vector3<f64>,
        t: f64,
    ) -> (Quaternion, Vector3<f64>) {
        let (i, j, k) = (AXIS, (AXIS + 1) % 3, (AXIS + 2) % 3);
        let half = 0.5 * t;
        let half_precession = (half * self.precession_rate) * pi;
        let half_spin = (half * self.spin_rate) * pi[i];
        let squared = Vector2::new(half_precession.norm_squared(), half_spin * half_spin);
        let (cos, sinc) = cos_sinc_pair(squared);
        let precession = Quaternion {
            w: cos.x,
            u: sinc.x * half_precession,
        };
        let sin = sinc.y * half_spin;
        // Add the change of Π, so that rounding of the angle does not affect |Π|.
        let (double, mut turned) = (sin + sin, *pi);
        let (across, along) = (double * cos.y, double * sin);
        turned[j] += across * pi[k] - along * pi[j];
        turned[k] -= across * pi[j] + along * pi[k];
        (precession.product_about::<AXIS>(cos.y, sin), turned)
    }

    fn flow_about_any(&self, pi: &Vector3<f64>, t: f64) -> (Quaternion, Vector3<f64>) {
        let precession = Quaternion::from_rotation_vector(&(pi * (t * self.precession_rate)));
        let angle = self.spin_rate * self.axis.dot(pi) * t;
        let spin = Quaternion::from_rotation_vector(&(self.axis * angle));
        (precession.product(&spin), spin.rotate_back(pi))
    }
}

#[cfg(test)]
mod tests {
    use lgvi_lie::orthogonality_error;
    use nalgebra::{Matrix3, Vector3};

    use crate::Inertia;
    use crate::rotation::FreeRotation;

    /// Although no result is normalized, a million equal rotations conserve |Π| up to the accumulated rounding of one
    /// rotation's change, `4 sin² ½α` of 1.5e-16 (3e-13 in total), and keep R orthogonal to rounding. This also holds
    /// if the axis is not a body axis.
    #[test]
    fn a_million_turns_keep_momentum_and_orthogonality() {
        let tilted = lgvi_lie::exp(&Vector3::new(0.3, 0.5, -0.2));
        for axis in 0..3 {
            let j = Matrix3::from_diagonal(&(Vector3::repeat(1.0) - Vector3::ith(axis, 0.7)));
            for j in [j, tilted * j * tilted.transpose()] {
                let flow = FreeRotation::new(&Inertia::new(j).unwrap());
                let start = Vector3::new(0.4, 0.35, -0.45);
                let (mut r, mut pi) = (Matrix3::identity(), start);
                for _ in 0..1_000_000 {
                    let (from, momentum) = (r, pi);
                    flow.carry(&from, &momentum, 0.05, (&mut r, &mut pi));
                }
                let drift = pi.norm_squared() / start.norm_squared() - 1.0;
                assert!(drift.abs() < 5e-13, "{axis}: {drift:e}");
                assert!(orthogonality_error(&r) < 2e-15);
                assert!((r * pi - start).norm() < 1e-9);
            }
        }
    }
}
