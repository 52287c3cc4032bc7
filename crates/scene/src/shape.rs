//! What a body looks like, as far as the scene tells.

use lgvi_dynamics::gravity::Polyhedron;
use lgvi_dynamics::{MassDistribution, PointMass, RigidBody};
use lgvi_lie::symmetric_eigen;
use nalgebra::{Matrix3, Vector3};

use crate::NamedBody;

/// The least size of a part, of the whole's: what is thinner would not be seen.
const LEAST: f64 = 0.02;

/// A solid in the frame of its body, in the scene's units.
///
/// # Assumptions and limitations
/// It is a picture, which nothing is computed from. Parts that would be thinner than 2 % of the body are drawn so thick.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape<'a> {
    /// The body's polyhedron.
    Mesh(&'a Polyhedron),
    /// Equal spheres at the body's points of mass, so large that they have the inertia that the points alone lack.
    Spheres {
        /// Where they are.
        centers: Vec<Vector3<f64>>,
        /// Their radius.
        radius: f64,
    },
    /// The homogeneous ellipsoid of the body's mass and inertia.
    Ellipsoid {
        /// Its center, which is the center of mass.
        center: Vector3<f64>,
        /// Its axes, the columns of a rotation matrix.
        axes: Matrix3<f64>,
        /// Half of its length along each.
        semi_axes: Vector3<f64>,
    },
}

impl NamedBody {
    /// The body's polyhedron, or spheres at its points, or the ellipsoid of its inertia.
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
    /// Radius of a sphere about the origin of the body's frame that holds all of it.
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

/// A sphere of mass m has the trace 6/5 m r² of its inertia, a point m at ρ has 2 m ρ².
fn spheres(body: &RigidBody, points: &[PointMass]) -> Shape<'static> {
    let centers: Vec<_> = points.iter().map(|point| point.position).collect();
    let of_points = points
        .iter()
        .map(|point| 2.0 * point.mass * point.position.norm_squared());
    let own = body.inertia().matrix().trace() - of_points.sum::<f64>();
    let radius = (5.0 / 6.0 * own.max(0.0) / body.mass()).sqrt();
    Shape::Spheres {
        radius: radius.max(LEAST * reach(&centers)),
        centers,
    }
}

/// An ellipsoid with these semi-axes has `J_d = ∫ρρᵀ dm = m/5 diag(a², b², c²)`, (3.6).
fn ellipsoid(body: &RigidBody) -> Shape<'static> {
    let mass = body.mass();
    // Off the origin in a pivoted body only.
    let moments = body
        .points()
        .iter()
        .map(|point| point.mass * point.position);
    let center = moments.sum::<Vector3<f64>>() / mass;
    let about_center = body.inertia().nonstandard() - mass * center * center.transpose();
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
