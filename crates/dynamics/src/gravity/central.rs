use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use super::{Field, LoadCurvature, LoadGradient};
use crate::{Load, PointMass, RigidBody};

/// A point attractor fixed at the origin of the inertial frame, acting on each body's points of mass:
/// `U = −Σ_q GM m_q / |x + R ρ_q|` (§4.7).
///
/// # Assumptions and limitations
/// The attractor does not move, whatever the bodies' mass. A point at the attractor itself has no finite load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Central {
    /// Gravitational parameter `GM` of the attractor.
    pub gm: f64,
}

/// One point of mass, seen from the attractor: `κ = GM m_q`, `d = x + R ρ`, `r = |d|`.
struct Sight {
    kappa: f64,
    d: Vector3<f64>,
    squared: f64,
    /// `κ/r³`
    pull: f64,
}

impl Sight {
    fn force(&self) -> Vector3<f64> {
        -self.pull * self.d
    }

    /// `G = −κ (I/r³ − 3 d dᵀ/r⁵) = ∂force/∂d`
    fn gradient(&self) -> Matrix3<f64> {
        (3.0 * self.pull / self.squared) * self.d * self.d.transpose()
            - Matrix3::from_diagonal_element(self.pull)
    }

    /// `T = ∂(G b)/∂d = κ [3 (b dᵀ + d bᵀ + (b·d) I)/r⁵ − 15 (b·d) d dᵀ/r⁷]`
    fn curvature(&self, b: &Vector3<f64>) -> Matrix3<f64> {
        let by_r5 = 3.0 * self.pull / self.squared;
        let bd = b.dot(&self.d);
        let mixed = b * self.d.transpose();
        by_r5 * (mixed + mixed.transpose() + Matrix3::from_diagonal_element(bd))
            - (5.0 * by_r5 * bd / self.squared) * self.d * self.d.transpose()
    }
}

impl Central {
    fn sight(&self, point: &PointMass, x: &Vector3<f64>, r: &Matrix3<f64>) -> Sight {
        let d = x + r * point.position;
        let squared = d.norm_squared();
        let kappa = self.gm * point.mass;
        Sight {
            kappa,
            d,
            squared,
            pull: kappa / (squared * squared.sqrt()),
        }
    }
}

impl Field for Central {
    fn load(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> Load {
        let mut load = Load::default();
        for point in body.points() {
            let force = self.sight(point, x, r).force();
            load.force += force;
            load.moment += point.position.cross(&r.tr_mul(&force));
        }
        load
    }

    fn potential(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> f64 {
        let each = |point| {
            let sight = self.sight(point, x, r);
            -sight.kappa / sight.squared.sqrt()
        };
        body.points().iter().map(each).sum()
    }

    fn gradient(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> LoadGradient {
        let mut sum = LoadGradient::default();
        for point in body.points() {
            let sight = self.sight(point, x, r);
            let arm = hat(&point.position);
            let g = sight.gradient();
            let back_g = r.tr_mul(&g);
            let r_arm = r * arm;
            sum.force_by_position += g;
            sum.force_by_attitude -= g * r_arm;
            sum.moment_by_position += arm * back_g;
            sum.moment_by_attitude += arm * (hat(&r.tr_mul(&sight.force())) - back_g * r_arm);
        }
        sum
    }

    fn curvature(
        &self,
        body: &RigidBody,
        x: &Vector3<f64>,
        r: &Matrix3<f64>,
        weights: &Load,
    ) -> LoadCurvature {
        let mut sum = LoadCurvature::default();
        for point in body.points() {
            let sight = self.sight(point, x, r);
            let arm = hat(&point.position);
            let c = weights.moment.cross(&point.position);
            let b = weights.force + r * c;
            let g = sight.gradient();
            let t = sight.curvature(&b);
            let turned = t * r * arm + g * r * hat(&c);
            sum.position_position += t;
            sum.position_attitude -= turned;
            sum.attitude_attitude += arm * (hat(&r.tr_mul(&(g * b))) - r.tr_mul(&turned))
                + hat(&c) * (hat(&r.tr_mul(&sight.force())) - r.tr_mul(&g) * r * arm);
        }
        sum
    }
}
