use nalgebra::{Matrix3, Vector3};

use super::{Attractor, Falloff, Form, Monopole, SourceShape};

/// A point attractor at the origin, or the exterior of a sphere: `φ = −GM/|d|` (§4.7).
///
/// # Assumptions and limitations
/// The load on a point at the attractor itself is not finite. Only a [`Fixed`](super::Fixed) attractor has a radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Central {
    /// Gravitational parameter `GM` of the attractor.
    pub gm: f64,
}

impl Central {
    /// `GM/r³` and `1/r²`.
    #[inline]
    fn pull(&self, d: &Vector3<f64>) -> (f64, f64) {
        let squared = d.norm_squared();
        let by_r2 = 1.0 / squared;
        (self.gm * (by_r2 * by_r2) * squared.sqrt(), by_r2)
    }
}

impl Attractor for Central {
    fn form(&self) -> Option<Form> {
        Some(Form::Attractor {
            shape: SourceShape::Point { gm: self.gm },
            placement: None,
        })
    }

    #[inline]
    fn potential(&self, d: &Vector3<f64>) -> f64 {
        -self.gm / d.norm()
    }

    #[inline]
    fn acceleration(&self, d: &Vector3<f64>) -> Vector3<f64> {
        -self.pull(d).0 * d
    }

    /// `G = −GM (I/r³ − 3 d dᵀ/r⁵)`
    #[inline]
    fn gradient(&self, d: &Vector3<f64>) -> Matrix3<f64> {
        let (pull, by_r2) = self.pull(d);
        (3.0 * pull * by_r2) * d * d.transpose() - Matrix3::from_diagonal_element(pull)
    }

    /// `T = GM [3 (b dᵀ + d bᵀ + (b·d) I)/r⁵ − 15 (b·d) d dᵀ/r⁷]`
    #[inline]
    fn curvature(&self, d: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
        let (pull, by_r2) = self.pull(d);
        let by_r5 = 3.0 * pull * by_r2;
        let bd = b.dot(d);
        let mixed = b * d.transpose();
        by_r5 * (mixed + mixed.transpose() + Matrix3::from_diagonal_element(bd))
            - (5.0 * by_r5 * bd * by_r2) * d * d.transpose()
    }

    #[inline]
    fn monopole(&self) -> Option<Monopole> {
        Some(Monopole {
            gm: self.gm,
            position: Vector3::zeros(),
            radius: 0.0,
        })
    }

    fn falloff(&self) -> Option<Falloff> {
        Some(Falloff {
            strength: self.gm,
            harmonic: 0.0,
        })
    }
}
