//! A body as it is drawn: its points of mass and the bars between them, or its surface.

use lgvi_dynamics::gravity::Polyhedron;
use lgvi_scene::{NamedBody, Shape as Solid};
use nalgebra::Vector3;

use super::data::Pose;

/// Subdivisions of the icosahedron that stands for an ellipsoid: 80 faces.
const SUBDIVISIONS: u32 = 1;

/// What is drawn of a body, body frame (m).
pub(super) struct Shape {
    /// Center of mass; another place than the origin in a pivoted body only.
    pub(super) center: Vector3<f64>,
    /// Points of mass, with their share of the mass; none where there is a surface.
    points: Vec<(Vector3<f64>, f64)>,
    vertices: Vec<Vector3<f64>>,
    /// Triangles, counterclockwise as seen from outside.
    pub(super) faces: Vec<[usize; 3]>,
}

impl Shape {
    /// `length` is the scene's unit (m).
    pub(super) fn of(named: &NamedBody, length: f64) -> Self {
        let body = &named.body;
        let shares = body.points().iter();
        let points: Vec<_> = shares
            .map(|point| (point.position * length, point.mass / body.mass()))
            .collect();
        let center = points.iter().map(|(position, share)| position * *share);
        let mut shape = Self {
            center: center.sum(),
            points: Vec::new(),
            vertices: Vec::new(),
            faces: Vec::new(),
        };
        match named.shape() {
            Solid::Mesh(mesh) => {
                shape.vertices = mesh.vertices().to_vec();
                shape.faces = mesh.faces().to_vec();
            }
            Solid::Spheres { .. } => shape.points = points,
            // A pendulum is its rod and its mass.
            Solid::Ellipsoid { .. } if shape.center != Vector3::zeros() => {
                shape.points = vec![(shape.center, 1.0)];
            }
            Solid::Ellipsoid {
                center,
                axes,
                semi_axes,
            } => {
                // One that is too small for a mesh is a point.
                if let Ok(mesh) = Polyhedron::ellipsoid(semi_axes.into(), SUBDIVISIONS, 1.0) {
                    let vertices = mesh.vertices().iter();
                    shape.vertices = vertices.map(|vertex| center + axes * vertex).collect();
                    shape.faces = mesh.faces().to_vec();
                }
            }
        }
        for vertex in &mut shape.vertices {
            *vertex *= length;
        }
        shape
    }

    /// Farthest point from the origin of the body frame (m).
    pub(super) fn reach(&self) -> f64 {
        let points = self.points.iter().map(|(position, _)| position);
        points
            .chain(&self.vertices)
            .map(Vector3::norm)
            .fold(0.0, f64::max)
    }

    /// Farthest point from the center of mass (m).
    pub(super) fn radius(&self) -> f64 {
        let points = self.points.iter().map(|(position, _)| position);
        let arms = points
            .chain(&self.vertices)
            .map(|point| point - self.center);
        arms.map(|arm| arm.norm()).fold(0.0, f64::max)
    }

    /// Farthest point from the center of mass along a unit vector of the body frame (m).
    pub(super) fn support(&self, axis: &Vector3<f64>) -> f64 {
        let along = self.vertices.iter().map(|v| axis.dot(&(v - self.center)));
        along.fold(0.0, f64::max)
    }

    /// Whether its attitude needs axes to be seen.
    pub(super) fn has_axes(&self) -> bool {
        self.points.len() < 2
    }

    /// The points of mass in the inertial frame (m), `enlarged` by a factor, with their share of the mass.
    pub(super) fn points_at(&self, pose: &Pose, enlarged: f64) -> Vec<(Vector3<f64>, f64)> {
        let points = self.points.iter();
        points
            .map(|(arm, share)| (placed(pose, arm, enlarged), *share))
            .collect()
    }

    /// The vertices of the surface, likewise.
    pub(super) fn vertices_at(&self, pose: &Pose, enlarged: f64) -> Vec<Vector3<f64>> {
        let vertices = self.vertices.iter();
        vertices
            .map(|vertex| placed(pose, vertex, enlarged))
            .collect()
    }

    /// The center of mass in the inertial frame (m).
    pub(super) fn center_at(&self, pose: &Pose) -> Vector3<f64> {
        placed(pose, &self.center, 1.0)
    }
}

fn placed(pose: &Pose, arm: &Vector3<f64>, enlarged: f64) -> Vector3<f64> {
    pose.position + enlarged * (pose.attitude * arm)
}
