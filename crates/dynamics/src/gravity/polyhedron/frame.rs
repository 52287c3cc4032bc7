use nalgebra::Vector3;

use super::Polyhedron;

/// The frame in which a field is computed: at the center of mass, in a unit of length that is a power of two and not
/// less than the body's reach from there. Numbers are then of order one, and the choice of units changes no bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    center: Vector3<f64>,
    pub(super) unit: f64,
}

impl Frame {
    pub(super) fn of(polyhedron: &Polyhedron) -> Self {
        let center = polyhedron.center();
        let distances = polyhedron.corners().map(|corner| (corner - center).norm());
        let reach = distances.fold(0.0, f64::max);
        let unit = libm::scalbn(1.0, libm::ilogb(reach) + 1);
        Self { center, unit }
    }

    /// A point of the body's frame in this frame.
    #[inline]
    pub(super) fn local(&self, d: &Vector3<f64>) -> Vector3<f64> {
        (d - self.center) / self.unit
    }
}
