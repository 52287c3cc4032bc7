use super::{Polyhedron, PolyhedronError, PolyhedronField};
use crate::PointMass;

/// A polyhedron as a body's mass: the field by which it attracts points, and the points on which other fields act.
///
/// # Assumptions and limitations
/// The points have the body's moments up to a degree n: what another field exerts on them errs by the power n + 1 of
/// this body's size over the distance (figures at [`Polyhedron::sparse_cloud`]). Its own field is exact.
#[derive(Clone, Debug, PartialEq)]
pub struct PolyhedronMass {
    field: PolyhedronField,
    cloud: Vec<PointMass>,
}

impl PolyhedronMass {
    /// With a sparse cloud of this degree.
    pub(crate) fn new(polyhedron: &Polyhedron, degree: usize) -> Result<Self, PolyhedronError> {
        Ok(Self {
            field: PolyhedronField::new(polyhedron, 1.0),
            cloud: polyhedron.sparse_cloud(degree)?,
        })
    }

    /// Its gravity with gravitational constant 1.
    pub fn field(&self) -> &PolyhedronField {
        &self.field
    }

    /// The points of mass on which other fields act.
    pub fn cloud(&self) -> &[PointMass] {
        &self.cloud
    }
}
