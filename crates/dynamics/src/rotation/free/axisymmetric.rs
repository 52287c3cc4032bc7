use lgvi_lie::Quaternion;
use nalgebra::Vector3;

/// A body with two equal moments: `F = exp(S(Π) t/J_t) exp(S(e) (1/J_a − 1/J_t) eᵀΠ t)`, with e the axis of symmetry and
/// `J_a`, `J_t` the moments about it and across it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axisymmetric {
    axis: Vector3<f64>,
    transverse: f64,
    /// `1/J_a − 1/J_t`
    relative_rate: f64,
}

impl Axisymmetric {
    pub(super) fn new(axis: Vector3<f64>, axial: f64, transverse: f64) -> Self {
        Self {
            axis,
            transverse,
            relative_rate: (transverse - axial) / transverse / axial,
        }
    }

    #[inline]
    pub(super) fn flow(&self, pi: &Vector3<f64>, t: f64) -> (Quaternion, Vector3<f64>) {
        let precession = Quaternion::from_rotation_vector(&(pi * (t / self.transverse)));
        let angle = self.relative_rate * self.axis.dot(pi) * t;
        let spin = Quaternion::from_rotation_vector(&(self.axis * angle));
        (precession.product(&spin), spin.rotate_back(pi))
    }
}
