use core::f64::consts::PI;
use std::sync::Arc;

use fearless_simd::Level;
use nalgebra::{Matrix3, Vector3};

use super::frame::Frame;
use super::mesh::{self, Cluster};
use super::series::Series;
use super::{Polyhedron, closed, slopes};
use crate::gravity::{Attractor, Monopole};

/// Gravity of a homogeneous polyhedron, outside and inside: near the body in closed form (R. A. Werner & D. J. Scheeres,
/// *Exterior gravitation of a polyhedron…*, Celest. Mech. Dyn. Astron. 65, 1996), `φ = −½ Gσ [Σ_e r·E_e r L_e − Σ_f r·F_f r
/// ω_f]`, where r is the vector from the field point `d` to any point of the edge or face.
///
/// Potential and acceleration are a series of solid harmonics about the center of mass wherever a degree up to 96 (less for
/// few faces) truncates less than half a unit in the last place of the acceleration of a point mass. This bound is proven
/// for each body when it is created. For a fine mesh it holds from 1.5 times the body's reach on.
///
/// The first and second derivatives are from that paper. The third derivatives need no transcendental function.
///
/// # Assumptions and limitations
/// - Inside the body φ is not harmonic: `tr G = −4πGσ`.
/// - Potential and acceleration are continuous and finite everywhere. The gradient jumps by `4πGσ n nᵀ` across a face.
///   On the face it is the mean of both sides, unless rounding places the point on one side. The curvature omits the
///   jump.
/// - Toward an edge the gradient grows as the logarithm of the distance and the curvature as its inverse. On the edge
///   they are not finite. At a distance δ their relative rounding error is `10⁻¹⁶ size/δ` of their largest term. Edges
///   between coplanar faces are not affected.
/// - The sums of the closed form cancel at large distance: the relative rounding error of gradient and curvature is about
///   `10⁻¹⁵ (d/size)²`. That of potential and acceleration is about `10⁻¹⁵` everywhere.
/// - The cost of the closed form is proportional to the number of faces. That of the series does not depend on it, and
///   falls with the distance.
#[derive(Clone, Debug, PartialEq)]
pub struct PolyhedronField {
    /// `Gσ`
    strength: f64,
    frame: Frame,
    clusters: Arc<[Cluster]>,
    series: Arc<Series>,
    faces: usize,
    radius: f64,
    monopole: Monopole,
}

impl PolyhedronField {
    /// Creates the gravity of `polyhedron`, in its own frame, with gravitational constant `G`.
    pub fn new(polyhedron: &Polyhedron, constant: f64) -> Self {
        let frame = Frame::of(polyhedron);
        Self {
            strength: constant * polyhedron.density(),
            frame,
            clusters: mesh::clusters(polyhedron, &frame).into(),
            series: Arc::new(Series::new(Level::new(), polyhedron, &frame)),
            faces: polyhedron.faces.len(),
            radius: polyhedron.bounding_radius(),
            monopole: Monopole {
                gm: constant * polyhedron.mass(),
                position: polyhedron.center(),
                radius: 0.0,
            },
        }
    }

    /// Returns this field with its strength multiplied by `factor`. The gravitational constant as factor converts a
    /// field made for the constant 1.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        scaled.strength *= factor;
        scaled.monopole.gm *= factor;
        scaled
    }

    /// The radius of the smallest sphere about the frame's origin that contains the body.
    pub fn bounding_radius(&self) -> f64 {
        self.radius
    }

    /// Returns true if `d` is inside. The faces' solid angles sum to `4π` inside and to zero outside. Undetermined on
    /// the surface itself.
    pub fn contains(&self, d: &Vector3<f64>) -> bool {
        if d.norm_squared() > self.radius * self.radius {
            return false;
        }
        closed::half_solid_angle(Level::new(), &self.clusters, &self.frame.local(d)) > PI
    }
}

/// Cost of a face and its edges, in multiples of a point mass.
const FACE: f64 = 0.7;

impl Attractor for PolyhedronField {
    fn cost(&self) -> f64 {
        FACE * self.series.cost().min(self.faces as f64)
    }

    fn potential(&self, d: &Vector3<f64>) -> f64 {
        let (d, unit, level) = (self.frame.local(d), self.frame.unit, Level::new());
        match self.series.degree(&d) {
            Some(degree) => self.monopole.gm / unit * self.series.potential(level, &d, degree),
            None => -self.strength * unit * unit * closed::potential(level, &self.clusters, &d),
        }
    }

    fn acceleration(&self, d: &Vector3<f64>) -> Vector3<f64> {
        let (d, unit, level) = (self.frame.local(d), self.frame.unit, Level::new());
        match self.series.degree(&d) {
            Some(degree) => {
                self.monopole.gm / (unit * unit) * self.series.acceleration(level, &d, degree)
            }
            None => 2.0 * self.strength * unit * closed::acceleration(level, &self.clusters, &d),
        }
    }

    fn gradient(&self, d: &Vector3<f64>) -> Matrix3<f64> {
        2.0 * self.strength * closed::gradient(Level::new(), &self.clusters, &self.frame.local(d))
    }

    fn curvature(&self, d: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
        let sum = slopes::curvature(&self.clusters, &self.frame.local(d), b);
        0.5 * self.strength / self.frame.unit * (sum + sum.transpose())
    }

    fn monopole(&self) -> Option<Monopole> {
        Some(self.monopole)
    }
}
