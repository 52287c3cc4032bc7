use lgvi_dynamics::BodyState;
use lgvi_lie::hat;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::TerminalError;
use crate::problem::pointing::across;

/// A Kepler ellipse as five conditions on position and momentum, all without dimension: with `r = x − center`,
/// `H = r × γ/m` and the eccentricity vector `e = (γ × (r × γ))/(m² GM) − r/|r|`,
/// `(H − H_d)/|H_d|` and the two components of `e − e_d` in the plane of the orbit.
///
/// The third component of `e` follows from `H · e = 0`. The conditions are independent on every ellipse, the circle
/// included, and vanish together on the orbit only.
#[derive(Clone, Debug)]
pub(crate) struct KeplerOrbit {
    center: Vector3<f64>,
    /// `1/(m² GM)`
    inverse: f64,
    /// `1/(m |H_d|)`
    scale: f64,
    /// `H_d/|H_d|`
    normal: Vector3<f64>,
    /// Two unit vectors that span the plane.
    plane: [Vector3<f64>; 2],
    /// The components of `e_d` along them.
    eccentricity: [f64; 2],
}

/// Below this part of `|r| |v|`, `|r × v|` is no orbit but a fall.
const RADIAL: f64 = 1e-9;

impl KeplerOrbit {
    /// The orbit through `arm` from `center` with `velocity`, of a body of `mass`.
    pub(super) fn new(
        gm: f64,
        center: Vector3<f64>,
        mass: f64,
        arm: &Vector3<f64>,
        velocity: &Vector3<f64>,
    ) -> Result<Self, TerminalError> {
        if !(gm.is_finite() && gm > 0.0) {
            return Err(TerminalError::Gm(gm));
        }
        let angular = arm.cross(velocity);
        let norm = angular.norm();
        let eccentricity = velocity.cross(&angular) / gm - arm / arm.norm();
        let turns = norm > RADIAL * arm.norm() * velocity.norm();
        if !(turns && eccentricity.norm() < 1.0) {
            return Err(TerminalError::Orbit {
                eccentricity: eccentricity.norm(),
                angular_momentum: angular.into(),
            });
        }
        let normal = angular / norm;
        let plane = across(&normal);
        Ok(Self {
            center,
            inverse: 1.0 / (mass * mass * gm),
            scale: 1.0 / (mass * norm),
            normal,
            plane,
            eccentricity: plane.map(|axis| axis.dot(&eccentricity)),
        })
    }

    pub(super) fn residual(&self, state: &BodyState) -> SVector<f64, 5> {
        let (r, gamma) = (state.position - self.center, state.linear_momentum);
        let angular = r.cross(&gamma);
        let eccentricity = self.inverse * gamma.cross(&angular) - r / r.norm();
        let h = self.scale * angular - self.normal;
        let [p, q] =
            std::array::from_fn(|i| self.plane[i].dot(&eccentricity) - self.eccentricity[i]);
        SVector::from([h.x, h.y, h.z, p, q])
    }

    pub(super) fn jacobian(&self, state: &BodyState) -> SMatrix<f64, 5, 6> {
        let (r, gamma) = (state.position - self.center, state.linear_momentum);
        let mut rows = SMatrix::<f64, 5, 6>::zeros();
        rows.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(-self.scale * hat(&gamma)));
        rows.fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&(self.scale * hat(&r)));
        let distance = r.norm();
        let unit = r / distance;
        for (row, q) in self.plane.iter().enumerate() {
            let by_position = self.inverse * (q * gamma.norm_squared() - gamma * q.dot(&gamma))
                - (q - unit * q.dot(&unit)) / distance;
            let by_momentum =
                self.inverse * (2.0 * q.dot(&r) * gamma - q * r.dot(&gamma) - r * q.dot(&gamma));
            rows.fixed_view_mut::<1, 3>(3 + row, 0)
                .copy_from(&by_position.transpose());
            rows.fixed_view_mut::<1, 3>(3 + row, 3)
                .copy_from(&by_momentum.transpose());
        }
        rows
    }

    pub(super) fn curvature(&self, state: &BodyState, nu: &SVector<f64, 5>) -> SMatrix<f64, 6, 6> {
        let (r, gamma) = (state.position - self.center, state.linear_momentum);
        let w = self.scale * nu.fixed_rows::<3>(0);
        let q = nu[3] * self.plane[0] + nu[4] * self.plane[1];
        let distance = r.norm();
        let unit = r / distance;
        let identity = Matrix3::identity();
        let along = q.dot(&unit);
        let both = q * unit.transpose();
        let position = (both + both.transpose() + along * identity
            - 3.0 * along * unit * unit.transpose())
            / (distance * distance);
        let cross = self.inverse
            * (2.0 * q * gamma.transpose() - gamma * q.transpose() - q.dot(&gamma) * identity)
            - hat(&w);
        let product = q * r.transpose();
        let momentum = self.inverse * (2.0 * q.dot(&r) * identity - product - product.transpose());
        let mut curvature = SMatrix::<f64, 6, 6>::zeros();
        curvature.fixed_view_mut::<3, 3>(0, 0).copy_from(&position);
        curvature.fixed_view_mut::<3, 3>(0, 3).copy_from(&cross);
        curvature
            .fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&cross.transpose());
        curvature.fixed_view_mut::<3, 3>(3, 3).copy_from(&momentum);
        curvature
    }
}
