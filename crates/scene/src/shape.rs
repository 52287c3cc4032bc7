//! The shape of a body for display, derived from the scene.

use lgvi_dynamics::gravity::Polyhedron;
use lgvi_dynamics::{MassDistribution, PointMass, RigidBody};
use lgvi_lie::symmetric_eigen;
use nalgebra::{Matrix3, Vector3};

use crate::NamedBody;

/// Smallest size of a part relative to the whole body, so that it stays visible.
const LEAST: f64 = 0.02;

/// A solid in the frame of its body, in the scene's units.
///
/// # Assumptions and limitations
/// The shape is for display only and enters no computation. Parts thinner than 2 % of the body are drawn with that
/// thickness.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape<'a> {
    /// The body's polyhedron.
    Mesh(&'a Polyhedron),
    /// Equal spheres at the body's point masses. Their radius supplies the inertia that the points alone lack.
    Spheres {
        /// Centers of the spheres.
        centers: Vec<Vector3<f64>>,
        /// Radius of the spheres.
        radius: f64,
    },
    /// The homogeneous ellipsoid with the body's mass and inertia.
    Ellipsoid {
        /// Center of the ellipsoid, which is the center of mass.
        center: Vector3<f64>,
        /// Principal axes, the columns of a rotation matrix.
        axes: Matrix3<f64>,
        /// Semi-axis along each principal axis.
        semi_axes: Vector3<f64>,
    },
}

impl NamedBody {
    /// Returns the body's polyhedron, or else spheres at its points, or else the ellipsoid of its inertia.
    pub fn shape(&self) -> Shape<'_> {
        if let Some(mesh) = &self.mesh {
            return Shape::Mesh(mesh);
        }
        match self.body.distribution() {
            MassDistribution::Points(points) if points.len() > 1 => spheres(&self.body, points),
            _ => ellipsoid(&self.body),
        }
    }
}

impl Shape<'_> {
    /// Returns the radius of a sphere about the origin of the body's frame that contains the shape.
    pub fn extent(&self) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.bounding_radius(),
            Self::Spheres { centers, radius } => reach(centers) + radius,
            Self::Ellipsoid {
                center, semi_axes, ..
            } => center.norm() + semi_axes.max(),
        }
    }
}

/// A sphere of mass m and radius r has an inertia of trace 6/5 m r², a point mass m at ρ one of trace 2 m ρ².
fn spheres(body: &RigidBody, points: &[PointMass]) -> Shape<'static> {
    let centers: Vec<_> = points.iter().map(|point| point.position).collect();
    let of_points = points
        .iter()
        .map(|point| 2.0 * point.mass * point.position.norm_squared());
    let own = body.locked_inertia().matrix().trace() - of_points.sum::<f64>();
    let radius = (5.0 / 6.0 * own.max(0.0) / body.mass()).sqrt();
    Shape::Spheres {
        radius: radius.max(LEAST * reach(&centers)),
        centers,
    }
}

/// An ellipsoid with these semi-axes has `J_d = ∫ρρᵀ dm = m/5 diag(a², b², c²)`, (3.6).
fn ellipsoid(body: &RigidBody) -> Shape<'static> {
    let mass = body.mass();
    // The center differs from the origin in a pivoted body only.
    let moments = body
        .points()
        .iter()
        .map(|point| point.mass * point.position);
    let center = moments.sum::<Vector3<f64>>() / mass;
    let about_center = body.locked_inertia().nonstandard() - mass * center * center.transpose();
    let Some(eigen) = symmetric_eigen(&about_center) else {
        return Shape::Spheres {
            centers: vec![center],
            radius: 0.0,
        };
    };
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let semi_axes = eigen
        .eigenvalues
        .map(|second| (5.0 * second.max(0.0) / mass).sqrt());
    let least = LEAST * semi_axes.max().max(center.norm());
    Shape::Ellipsoid {
        center,
        axes,
        semi_axes: semi_axes.map(|semi_axis| semi_axis.max(least)),
    }
}

fn reach(centers: &[Vector3<f64>]) -> f64 {
    centers.iter().map(Vector3::norm).fold(0.0, f64::max)
}
