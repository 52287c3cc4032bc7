use core::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use super::Polyhedron;
use super::dyads::{self, EdgeDyad, FaceDyad};
use crate::gravity::{Attractor, Monopole};

/// Gravity of a homogeneous polyhedron in closed form, outside and inside (R. A. Werner & D. J. Scheeres, *Exterior
/// gravitation of a polyhedron…*, Celest. Mech. Dyn. Astron. 65, 1996): `φ = −½ Gσ [Σ_e r·E_e r L_e − Σ_f r·F_f r
/// ω_f]`, where r is the vector from the field point `d` to any point of the edge or face.
///
/// The first and second derivatives are from that paper. The third derivatives are sums over edges of `∂L_e/∂d = e
/// (r_a/a + r_b/b)/q` and `∂ω/∂d = (r_a × r_b)(a + b)/(a b q)`, with `q = a b + r_a·r_b`, and need no transcendental
/// function.
///
/// # Assumptions and limitations
/// - Inside the body φ is not harmonic: `tr G = −4πGσ`.
/// - Potential and acceleration are continuous and finite everywhere. The gradient jumps by `4πGσ n nᵀ` across a face.
///   On the face it is the mean of both sides, unless rounding places the point on one side. The curvature omits the
///   jump.
/// - Toward an edge the gradient grows as the logarithm of the distance and the curvature as its inverse. On the edge
///   they are not finite. At a distance δ their relative rounding error is `10⁻¹⁶ size/δ` of their largest term. Edges
///   between coplanar faces are not affected.
/// - The sums cancel at large distance: the relative rounding error of all four quantities is about `10⁻¹⁵ (d/size)²`.
/// - The cost is proportional to the number of faces.
#[derive(Clone, Debug, PartialEq)]
pub struct PolyhedronField {
    /// `Gσ`
    strength: f64,
    edges: Vec<EdgeDyad>,
    faces: Vec<FaceDyad>,
    radius: f64,
    monopole: Monopole,
}

impl PolyhedronField {
    /// Creates the gravity of `polyhedron`, in its own frame, with gravitational constant `G`.
    pub fn new(polyhedron: &Polyhedron, constant: f64) -> Self {
        let (edges, faces) = dyads::of(polyhedron);
        Self {
            strength: constant * polyhedron.density(),
            edges,
            faces,
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
        let angle = |face: &FaceDyad| face.height_and_angle(d).1;
        self.faces.iter().map(angle).sum::<f64>() > 2.0 * PI
    }
}

/// Cost of an edge and of a face, in multiples of a point mass.
const EDGE: f64 = 1.3;
const FACE: f64 = 1.6;

impl Attractor for PolyhedronField {
    fn cost(&self) -> f64 {
        EDGE * self.edges.len() as f64 + FACE * self.faces.len() as f64
    }

    fn potential(&self, d: &Vector3<f64>) -> f64 {
        let mut sum = 0.0;
        for edge in &self.edges {
            let sight = edge.seen_from(d);
            let logarithm = edge.logarithm(&sight);
            // Toward the edge, L grows logarithmically while E r decreases linearly, so the term vanishes.
            if logarithm.is_finite() {
                let r = &sight.r[0];
                sum += logarithm * r.dot(&(edge.dyad * r));
            }
        }
        for face in &self.faces {
            let (height, angle) = face.height_and_angle(d);
            sum -= angle * height * height;
        }
        -0.5 * self.strength * sum
    }

    fn acceleration(&self, d: &Vector3<f64>) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for edge in &self.edges {
            let sight = edge.seen_from(d);
            let logarithm = edge.logarithm(&sight);
            if logarithm.is_finite() {
                sum -= edge.dyad * (logarithm * sight.r[0]);
            }
        }
        for face in &self.faces {
            let (height, angle) = face.height_and_angle(d);
            sum += angle * height * face.normal;
        }
        self.strength * sum
    }

    fn gradient(&self, d: &Vector3<f64>) -> Matrix3<f64> {
        let mut sum = Matrix3::zeros();
        for edge in &self.edges {
            sum += edge.logarithm(&edge.seen_from(d)) * edge.dyad;
        }
        for face in &self.faces {
            let (_, angle) = face.height_and_angle(d);
            sum -= angle * face.normal * face.normal.transpose();
        }
        self.strength * sum
    }

    fn curvature(&self, d: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
        let mut sum = Matrix3::zeros();
        for edge in &self.edges {
            let [logarithm, angle] = edge.slopes(&edge.seen_from(d));
            sum += edge.dyad * b * logarithm.transpose() - edge.jump * b * angle.transpose();
        }
        0.5 * self.strength * (sum + sum.transpose())
    }

    fn monopole(&self) -> Option<Monopole> {
        Some(self.monopole)
    }
}
