use nalgebra::{DMatrix, SymmetricEigen};

use super::{Polyhedron, PolyhedronError};
use crate::PointMass;

/// Degree up to which clouds take little memory and time.
const MOST_DEGREE: usize = 10;

/// Share of the body's mass that is rounding: of a face whose plane holds the centre, of either sign.
const LEAST_SHARE: f64 = 1e-16;

impl Polyhedron {
    /// Points of mass, from the centre of mass, with all moments of the body up to this degree (at most 10): Gauss points
    /// of the tetrahedra between centre and faces, `⌈(degree + 1)/2⌉³` each.
    ///
    /// The potential of another attractor on this body is the sum over the points, with an error that falls as the
    /// power `degree + 1` of the tetrahedra's size over the distance.
    ///
    /// # Assumptions and limitations
    /// Where the centre sees a face from behind (a body that is not star-shaped), its points have negative mass.
    pub fn cloud(&self, degree: usize) -> Result<Vec<PointMass>, PolyhedronError> {
        if degree > MOST_DEGREE {
            return Err(PolyhedronError::Degree {
                found: degree,
                limit: MOST_DEGREE,
            });
        }
        Ok(self.gauss_points(degree))
    }

    /// The cloud of any degree.
    pub(super) fn gauss_points(&self, degree: usize) -> Vec<PointMass> {
        let count = degree / 2 + 1;
        let [radial, across, along] = [2, 1, 0].map(|power| gauss(count, power));
        let mut points = Vec::with_capacity(self.faces.len() * count * count * count);
        for [a, b, c] in self.tetrahedra(&self.centre) {
            // ρ = t [a + u (b − a + v (c − b))] with dV = 6 V t² u dt du dv
            let scale = self.density * a.dot(&b.cross(&c));
            if scale.abs() <= LEAST_SHARE * self.mass() {
                continue;
            }
            for &(t, by_t) in &radial {
                for &(u, by_u) in &across {
                    for &(v, by_v) in &along {
                        points.push(PointMass {
                            mass: scale * by_t * by_u * by_v,
                            position: t * (a + u * (b - a + v * (c - b))),
                        });
                    }
                }
            }
        }
        points
    }
}

/// Nodes and weights of `∫₀¹ t^power f(t) dt`, exact for f of degree `2 count − 1`: eigenvalues of the Jacobi matrix and
/// the squares of its eigenvectors' first components (G. H. Golub & J. H. Welsch, Math. Comp. 23, 1969).
fn gauss(count: usize, power: u32) -> Vec<(f64, f64)> {
    let alpha = f64::from(power);
    let mut jacobi = DMatrix::zeros(count, count);
    for k in 0..count {
        let n = 2.0 * k as f64 + alpha;
        jacobi[(k, k)] = if n == 0.0 {
            0.5
        } else {
            0.5 + 0.5 * alpha * alpha / (n * (n + 2.0))
        };
        if k > 0 {
            let k_plus = k as f64 * (k as f64 + alpha);
            let off = k_plus / (n * (n * n - 1.0).sqrt());
            jacobi[(k, k - 1)] = off;
            jacobi[(k - 1, k)] = off;
        }
    }
    #[expect(
        clippy::disallowed_methods,
        reason = "known matrices of a few rows, for which the iteration ends"
    )]
    let eigen = SymmetricEigen::new(jacobi);
    let weight = |column: usize| {
        let first = eigen.eigenvectors[(0, column)];
        first * first / (alpha + 1.0)
    };
    let nodes = eigen.eigenvalues.iter().enumerate();
    nodes.map(|(k, &node)| (node, weight(k))).collect()
}
