//! Polhodes: the curves of constant energy on the sphere of constant `|Π|`, on which a free body's angular momentum runs
//! in the body frame.

use std::f64::consts::TAU;

use lgvi_lie::symmetric_eigen;
use nalgebra::{Matrix3, Vector3};

/// Points of a curve.
const POINTS: u32 = 240;

/// Curves on either side of the separatrix, of each pair.
const LEVELS: u32 = 4;

/// The curves of constant energy of a body on the unit sphere of `Π/|Π|`.
pub(super) struct Polhodes {
    /// Columns: axes of the least, middle and greatest moment of inertia, body frame.
    axes: Matrix3<f64>,
    /// `1/J`, falling.
    inverse: [f64; 3],
}

impl Polhodes {
    /// Of a body with inertia `J`.
    pub(super) fn new(inertia: &Matrix3<f64>) -> Self {
        let (moments, axes) = symmetric_eigen(inertia).map_or_else(
            || (inertia.diagonal(), Matrix3::identity()),
            |eigen| (eigen.eigenvalues, eigen.eigenvectors),
        );
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| moments[*a].total_cmp(&moments[*b]));
        Self {
            axes: Matrix3::from_columns(&order.map(|i| axes.column(i).into_owned())),
            inverse: order.map(|i| 1.0 / moments[i]),
        }
    }

    /// Axes of the least, middle and greatest moment of inertia.
    pub(super) fn axes(&self) -> [Vector3<f64>; 3] {
        [0, 1, 2].map(|i| self.axes.column(i).into_owned())
    }

    /// Twice the energy at a point of the unit sphere, `Πᵀ J⁻¹ Π`.
    #[cfg(test)]
    fn level(&self, point: &Vector3<f64>) -> f64 {
        let principal = self.axes.tr_mul(point);
        principal.map(|c| c * c).dot(&Vector3::from(self.inverse))
    }

    /// Curves about the axes of least and greatest moment, evenly between axis and separatrix.
    pub(super) fn curves(&self) -> Vec<Vec<Vector3<f64>>> {
        let [most, middle, least] = self.inverse;
        let mut curves = Vec::new();
        for k in 1..=LEVELS {
            // The square spaces the curves evenly, for energy rises quadratically from the axis.
            let part = f64::from(k) / f64::from(LEVELS + 1);
            curves.extend(self.about(0, most - (most - middle) * part * part));
            curves.extend(self.about(2, least + (middle - least) * part * part));
        }
        curves
    }

    /// The curves through the middle axis, which part the turning about the other two.
    pub(super) fn separatrix(&self) -> Vec<Vec<Vector3<f64>>> {
        self.about(2, self.inverse[1])
    }

    /// The two curves of `level` about principal axis `axis`, one about either end; none where there is no room.
    fn about(&self, axis: usize, level: f64) -> Vec<Vec<Vector3<f64>>> {
        // With c² = 1 − a² − b² the level curve is an ellipse in the other two components.
        let others = [(axis + 1) % 3, (axis + 2) % 3];
        let excess = level - self.inverse[axis];
        let half_axes = others.map(|other| {
            let square = excess / (self.inverse[other] - self.inverse[axis]);
            (square > 0.0 && square.is_finite()).then(|| square.sqrt())
        });
        let [Some(a), Some(b)] = half_axes else {
            return Vec::new();
        };
        [1.0, -1.0]
            .map(|side| {
                let point = |k: u32| {
                    let (sin, cos) = libm::sincos(TAU * f64::from(k) / f64::from(POINTS));
                    let (first, second) = (a * cos, b * sin);
                    let mut principal = Vector3::zeros();
                    principal[others[0]] = first;
                    principal[others[1]] = second;
                    let rest: f64 = 1.0 - first * first - second * second;
                    principal[axis] = side * rest.max(0.0).sqrt();
                    self.axes * principal
                };
                (0..=POINTS).map(point).collect()
            })
            .into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polhodes_lie_on_the_sphere_and_keep_their_energy() {
        let inertia = Matrix3::new(2.0, 0.3, 0.1, 0.3, 1.5, -0.2, 0.1, -0.2, 2.5);
        let polhodes = Polhodes::new(&inertia);
        let curves = polhodes.curves();
        assert_eq!(curves.len(), 4 * LEVELS as usize);
        for curve in curves.into_iter().chain(polhodes.separatrix()) {
            let level = polhodes.level(&curve[0]);
            for point in curve {
                assert!((point.norm() - 1.0).abs() < 1e-12);
                assert!((polhodes.level(&point) - level).abs() < 1e-12);
            }
        }
        let [_, middle, _] = polhodes.axes();
        let meets = |curve: &Vec<Vector3<f64>>| {
            curve
                .iter()
                .any(|point| (point.dot(&middle).abs() - 1.0).abs() < 1e-9)
        };
        assert!(polhodes.separatrix().iter().all(meets));
    }

    #[test]
    fn a_ball_has_no_polhodes_and_a_dumbbell_only_circles() {
        assert!(Polhodes::new(&Matrix3::identity()).curves().is_empty());
        let dumbbell = Polhodes::new(&Matrix3::from_diagonal(&Vector3::new(0.1, 1.0, 1.0)));
        assert_eq!(dumbbell.curves().len(), 2 * LEVELS as usize);
        assert!(dumbbell.separatrix().is_empty());
    }
}
