use nalgebra::{Matrix3, Vector3};

use super::Polyhedron;
use super::surface::Edge;

/// The position-independent data of an edge: Werner & Scheeres' `E_e` and related quantities.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EdgeDyad {
    ends: [Vector3<f64>; 2],
    along: Vector3<f64>,
    length: f64,
    /// `E = n_A m_Aᵀ + n_B m_Bᵀ`, where n are the normals of the faces that share the edge, and m the normals of the
    /// edge in the planes of these faces.
    pub(super) dyad: Matrix3<f64>,
    /// `F_A − F_B`.
    pub(super) jump: Matrix3<f64>,
}

/// An edge relative to a field point: the vectors to its ends, and their lengths.
pub(super) struct EdgeSight {
    pub(super) r: [Vector3<f64>; 2],
    distance: [f64; 2],
}

impl EdgeDyad {
    pub(super) fn seen_from(&self, d: &Vector3<f64>) -> EdgeSight {
        let r = self.ends.map(|end| end - d);
        let distance = r.map(|r| r.norm_squared().sqrt());
        EdgeSight { r, distance }
    }

    /// `L = ∫ ds/r = ln[(a + b + e)/(a + b − e)] = 2 artanh[e/(a + b)]`, infinite on the edge, with `(a + b)² − e² = 2
    /// q`.
    // Inlined, because a call would pass the sight through memory.
    #[inline(always)]
    pub(super) fn logarithm(&self, sight: &EdgeSight) -> f64 {
        let e = self.length;
        let around = sight.distance[0] + sight.distance[1];
        if e < SMALL * around {
            let z = e / around;
            2.0 * z * inverse_tangent_series(z * z)
        } else {
            libm::log1p(e * (around + e) / self.q(sight))
        }
    }

    /// `∂L/∂d = e (r_a/a + r_b/b)/q`, and the contribution of this edge to face A's `∂ω/∂d = ∫ r × ds/r³ = (r_a ×
    /// r_b)(a + b)/(a b q)`.
    #[inline(always)]
    pub(super) fn slopes(&self, sight: &EdgeSight) -> [Vector3<f64>; 2] {
        let [a, b] = sight.distance;
        let scale = 1.0 / (a * b * self.q(sight));
        let along = self.length * scale * (b * sight.r[0] + a * sight.r[1]);
        [along, (a + b) * scale * self.cross(sight)]
    }

    /// `q = a b + r_a·r_b`, zero only on the edge.
    #[inline(always)]
    fn q(&self, sight: &EdgeSight) -> f64 {
        let product = sight.distance[0] * sight.distance[1];
        let dot = sight.r[0].dot(&sight.r[1]);
        if dot < 0.0 {
            // (a b + r_a·r_b)(a b − r_a·r_b) = |r_a × r_b|² avoids cancellation near the edge.
            self.cross(sight).norm_squared() / (product - dot)
        } else {
            product + dot
        }
    }

    /// `r_a × r_b = r_a × (r_b − r_a)`, which avoids cancellation at large distance.
    #[inline(always)]
    fn cross(&self, sight: &EdgeSight) -> Vector3<f64> {
        sight.r[0].cross(&self.along)
    }
}

/// The data of a face: its normal n, which gives `F_f = n nᵀ`, its corners, and twice its area.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FaceDyad {
    corners: [Vector3<f64>; 3],
    pub(super) normal: Vector3<f64>,
    doubled_area: f64,
}

impl FaceDyad {
    /// The height `n·r` of the face's plane above `d`, and the solid angle ω of the face from there (A. van Oosterom &
    /// J. Strackee, IEEE Trans. BME 30, 1983), positive if `d` is behind the face. In the plane of the face ω is set to
    /// zero, the mean of both sides.
    #[inline(always)]
    pub(super) fn height_and_angle(&self, d: &Vector3<f64>) -> (f64, f64) {
        let [ra, rb, rc] = self.corners.map(|corner| corner - d);
        let height = self.normal.dot(&ra);
        if height == 0.0 {
            return (0.0, 0.0);
        }
        let [a, b, c] = [ra, rb, rc].map(|r| r.norm_squared().sqrt());
        let real = a * (b * c + rb.dot(&rc)) + b * rc.dot(&ra) + c * ra.dot(&rb);
        let imaginary = self.doubled_area * height;
        let half = if imaginary.abs() < SMALL * real {
            let t = imaginary / real;
            t * inverse_tangent_series(-t * t)
        } else {
            libm::atan2(imaginary, real)
        };
        (height, 2.0 * half)
    }
}

/// Arguments below which [`inverse_tangent_series`] is exact to rounding. Most arguments are below it for a fine mesh
/// or at large distance.
const SMALL: f64 = 0.125;

/// `artanh(z)/z` for `w = z²` and `arctan(t)/t` for `w = −t²`: `1 + w/3 + w²/5 + …`, up to `w⁸ ≤ 64⁻⁸`.
fn inverse_tangent_series(w: f64) -> f64 {
    let coefficients = [15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0].map(|n: f64| n.recip());
    let horner = |sum, coefficient| sum * w + coefficient;
    coefficients.into_iter().fold(1.0 / 17.0, horner)
}

/// Difference between two face normals below which it is rounding error. The faces are then coplanar, and their edge
/// contributes nothing.
const FLAT: f64 = 1e-15;

pub(super) fn of(polyhedron: &Polyhedron) -> (Vec<EdgeDyad>, Vec<FaceDyad>) {
    let face = |face: &[usize; 3]| {
        let corners = face.map(|corner| polyhedron.vertices[corner]);
        let doubled = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let doubled_area = doubled.norm();
        FaceDyad {
            corners,
            normal: doubled / doubled_area,
            doubled_area,
        }
    };
    let faces: Vec<_> = polyhedron.faces.iter().map(face).collect();
    let edge = |edge: &Edge| {
        let ends = edge.ends.map(|end| polyhedron.vertices[end]);
        let along = ends[1] - ends[0];
        let length = along.norm();
        let [a, b] = edge.faces.map(|face| faces[face].normal);
        let dyad = (a * along.cross(&a).transpose() - b * along.cross(&b).transpose()) / length;
        ((a - b).amax() > FLAT).then(|| EdgeDyad {
            ends,
            along,
            length,
            dyad: 0.5 * (dyad + dyad.transpose()),
            jump: a * a.transpose() - b * b.transpose(),
        })
    };
    (polyhedron.edges.iter().filter_map(edge).collect(), faces)
}
