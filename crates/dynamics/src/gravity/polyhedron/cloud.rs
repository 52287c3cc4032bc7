use super::{Polyhedron, PolyhedronError};
use crate::PointMass;
use crate::quadrature::gauss_jacobi;

/// Largest degree for which clouds take little memory and time.
const MOST_DEGREE: usize = 10;

/// Fraction of the body's mass below which a tetrahedron's mass, of either sign, is rounding error: the plane of its
/// face contains the center.
const LEAST_SHARE: f64 = 1e-16;

impl Polyhedron {
    /// Point masses, relative to the center of mass, that reproduce all moments of the body up to this degree (at most
    /// 10). They are the Gauss points of the tetrahedra between center and faces, `⌈(degree + 1)/2⌉³` each.
    ///
    /// The potential of another attractor on this body is the sum over the points. Its error decays as the power
    /// `degree + 1` of the tetrahedra's size over the distance.
    ///
    /// # Assumptions and limitations
    /// If the center sees a face from behind (the body is not star-shaped), the points of its tetrahedron have negative
    /// mass.
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
        // From the surface inwards, because the sparse clouds built from these points are then more accurate.
        let rule = |power| {
            let mut rule = gauss_jacobi(count as u32, 0, power);
            rule.reverse();
            rule
        };
        let [radial, across, along] = [2, 1, 0].map(rule);
        let mut points = Vec::with_capacity(self.faces.len() * count * count * count);
        for [a, b, c] in self.tetrahedra(&self.center) {
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
