//! Homogeneous polyhedra: shape, mass properties, gravity, and the clouds of points that represent them.

mod closed;
mod cloud;
mod distribution;
mod error;
mod field;
mod frame;
mod harmonics;
mod mass;
mod mesh;
mod obj;
mod recombination;
mod series;
mod shapes;
mod slopes;
mod surface;
#[cfg(test)]
mod tests;

use nalgebra::Vector3;

pub use distribution::PolyhedronMass;
pub use error::{ObjError, PolyhedronError};
pub use field::PolyhedronField;

use surface::Edge;

/// A body of constant density bounded by triangles.
///
/// # Assumptions and limitations
/// The surface must be closed and consistently oriented, which is checked. It may have handles, cavities (whose faces
/// point into them) and several parts. It must not intersect itself, which is not checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyhedron {
    vertices: Vec<Vector3<f64>>,
    faces: Vec<[usize; 3]>,
    edges: Vec<Edge>,
    density: f64,
    volume: f64,
    center: Vector3<f64>,
}

/// Volume, in units of the largest extent cubed, below which it is rounding error.
const LEAST_VOLUME: f64 = 1e-14;

impl Polyhedron {
    /// Creates a polyhedron of this density with these vertices (any frame fixed in the body) and faces. Each face
    /// consists of three indices into `vertices` from 0, anticlockwise seen from outside.
    pub fn new(
        vertices: Vec<Vector3<f64>>,
        faces: Vec<[usize; 3]>,
        density: f64,
    ) -> Result<Self, PolyhedronError> {
        if !(density.is_finite() && density > 0.0) {
            return Err(PolyhedronError::Density(density));
        }
        let edges = surface::edges(&vertices, &faces)?;
        let mut polyhedron = Self {
            vertices,
            faces,
            edges,
            density,
            volume: 0.0,
            center: Vector3::zeros(),
        };
        let first_corner = polyhedron.corners().next();
        let Some(apex) = first_corner else {
            return Err(PolyhedronError::Volume(0.0));
        };
        let reach = polyhedron
            .corners()
            .fold(0.0, |reach: f64, corner| reach.max((corner - apex).norm()));
        let (volume, first) = polyhedron.volume_moments(&apex);
        let bound = LEAST_VOLUME * reach * reach * reach;
        if !(volume.is_finite() && volume > bound) {
            return Err(PolyhedronError::Volume(volume));
        }
        polyhedron.volume = volume;
        polyhedron.center = apex + first / volume;
        let mass = polyhedron.mass();
        if !(mass.is_finite() && mass > 0.0) {
            return Err(PolyhedronError::Mass(mass));
        }
        Ok(polyhedron)
    }

    /// Returns this shape with the density that gives it this mass.
    pub fn with_mass(self, mass: f64) -> Result<Self, PolyhedronError> {
        let density = mass / self.volume;
        if mass.is_finite() && mass > 0.0 && density.is_finite() && density > 0.0 {
            Ok(Self { density, ..self })
        } else {
            Err(PolyhedronError::Mass(mass))
        }
    }

    /// Returns this body in the parallel frame whose origin is its center of mass.
    pub fn recentered(mut self) -> Self {
        for vertex in &mut self.vertices {
            *vertex -= self.center;
        }
        self.center = Vector3::zeros();
        self
    }

    /// The vertices.
    pub fn vertices(&self) -> &[Vector3<f64>] {
        &self.vertices
    }

    /// The faces: indices of vertices from 0, anticlockwise seen from outside.
    pub fn faces(&self) -> &[[usize; 3]] {
        &self.faces
    }

    /// The density `σ`.
    pub fn density(&self) -> f64 {
        self.density
    }

    /// The radius of the smallest sphere about the frame's origin that contains the body.
    pub fn bounding_radius(&self) -> f64 {
        self.corners()
            .fold(0.0, |radius: f64, corner| radius.max(corner.norm()))
    }

    /// Corners of all faces.
    fn corners(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.faces
            .iter()
            .flatten()
            .map(|&corner| self.vertices[corner])
    }
}
