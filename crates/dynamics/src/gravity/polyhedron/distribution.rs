use super::{Polyhedron, PolyhedronError, PolyhedronField};
use crate::PointMass;

/// A polyhedron as the mass distribution of a body: the field by which it attracts points, and the points on which
/// other fields act.
///
/// # Assumptions and limitations
/// The points reproduce the body's moments up to a degree n. The load of another field on them has an error of order
/// n + 1 in this body's size over the distance (figures at [`Polyhedron::sparse_cloud`]). The body's own field is
/// exact.
#[derive(Clone, Debug, PartialEq)]
pub struct PolyhedronMass {
    field: PolyhedronField,
    cloud: Vec<PointMass>,
}

impl PolyhedronMass {
    /// Creates the distribution with a sparse cloud of this degree.
    pub(crate) fn new(polyhedron: &Polyhedron, degree: usize) -> Result<Self, PolyhedronError> {
        Ok(Self {
            field: PolyhedronField::new(polyhedron, 1.0),
            cloud: polyhedron.sparse_cloud(degree)?,
        })
    }

    /// The body's gravity field with gravitational constant 1.
    pub fn field(&self) -> &PolyhedronField {
        &self.field
    }

    /// The point masses on which other fields act.
    pub fn cloud(&self) -> &[PointMass] {
        &self.cloud
    }
}
