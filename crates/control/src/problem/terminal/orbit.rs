use lgvi_dynamics::BodyState;
use lgvi_lie::hat;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{Row, TerminalCondition};
use crate::problem::parameter::{length, point};
use crate::problem::pointing::across;
use crate::problem::{ParameterError, Place};

/// Any phase of a Kepler ellipse, as five dimensionless conditions on position and momentum: `(H − H_d)/|H_d|` and the
/// two components of `e − e_d` in the plane of the orbit, with `r = x − center`, `H = r × γ/m` and the eccentricity
/// vector `e = (γ × (r × γ))/(m² GM) − r/|r|`.
///
/// The third component of `e` follows from `H · e = 0`. The conditions are independent on every ellipse, including the
/// circle, and vanish together only on the orbit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeplerOrbit {
    gm: f64,
    center: Vector3<f64>,
    mass: f64,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    /// `1/(m² GM)`
    inverse: f64,
    /// `1/(m |H_d|)`
    scale: f64,
    /// `H_d/|H_d|`
    normal: Vector3<f64>,
    /// Two unit vectors that span the plane of the orbit.
    plane: [Vector3<f64>; 2],
    /// The components of `e_d` along `plane`.
    eccentricity: [f64; 2],
}

/// If `|r × v|` is below this part of `|r| |v|`, the motion is radial and not an orbit.
const RADIAL: f64 = 1e-9;

impl KeplerOrbit {
    /// The elliptic orbit of a body of `mass` about an attractor with gravitational parameter `gm` at `center`, through
    /// `position` with `velocity` (inertial frame).
    pub fn new(
        gm: f64,
        center: Vector3<f64>,
        mass: f64,
        position: Vector3<f64>,
        velocity: Vector3<f64>,
    ) -> Result<Self, ParameterError> {
        length("gm", gm)?;
        length("mass", mass)?;
        point("velocity", velocity)?;
        let arm = point("position", position)? - point("center", center)?;
        let angular = arm.cross(&velocity);
        let norm = angular.norm();
        let turns = norm > RADIAL * arm.norm() * velocity.norm();
        if !turns {
            let value = [position.as_slice(), velocity.as_slice()];
            let expected = "a state that does not move through the attractor";
            return Err(ParameterError::new("orbit", value, expected));
        }
        let eccentricity = velocity.cross(&angular) / gm - arm / arm.norm();
        let bound = eccentricity.norm() < 1.0;
        if !bound {
            let escape = (2.0 * gm / arm.norm()).sqrt();
            let expected = format!("a speed below {escape}, that of escape");
            return Err(ParameterError::new(
                "velocity",
                velocity.as_slice(),
                expected,
            ));
        }
        let normal = angular / norm;
        let plane = across(&normal);
        Ok(Self {
            gm,
            center,
            mass,
            position,
            velocity,
            inverse: 1.0 / (mass * mass * gm),
            scale: 1.0 / (mass * norm),
            normal,
            plane,
            eccentricity: plane.map(|axis| axis.dot(&eccentricity)),
        })
    }

    /// The gravitational parameter.
    pub fn gm(&self) -> f64 {
        self.gm
    }

    /// The position of the attractor.
    pub fn center(&self) -> Vector3<f64> {
        self.center
    }

    /// A position on the orbit.
    pub fn position(&self) -> Vector3<f64> {
        self.position
    }

    /// The velocity at that position.
    pub fn velocity(&self) -> Vector3<f64> {
        self.velocity
    }

    /// The eccentricity vector and `r × γ` of a state.
    fn elements(&self, x: &Vector3<f64>, gamma: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let r = x - self.center;
        let momentum = r.cross(gamma);
        [
            self.inverse * gamma.cross(&momentum) - r / r.norm(),
            momentum,
        ]
    }
}

impl TerminalCondition for KeplerOrbit {
    fn name(&self) -> &'static str {
        "an orbit"
    }

    fn place(&self) -> Place {
        Place::Position
    }

    fn rows(&self) -> [Row; 6] {
        use Row::{None, Number};
        [Number, Number, Number, Number, Number, None]
    }

    fn residual(&self, state: &BodyState) -> SVector<f64, 6> {
        let [eccentricity, angular] = self.elements(&state.position, &state.linear_momentum);
        let h = self.scale * angular - self.normal;
        let [p, q] =
            std::array::from_fn(|i| self.plane[i].dot(&eccentricity) - self.eccentricity[i]);
        SVector::from([h.x, h.y, h.z, p, q, 0.0])
    }

    fn jacobian(&self, state: &BodyState) -> SMatrix<f64, 6, 6> {
        let (r, gamma) = (state.position - self.center, state.linear_momentum);
        let mut rows = SMatrix::<f64, 6, 6>::zeros();
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

    fn curvature(&self, state: &BodyState, nu: &SVector<f64, 6>) -> SMatrix<f64, 6, 6> {
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

    fn aim(&self, state: &mut BodyState) -> [bool; 2] {
        state.position = self.position;
        state.linear_momentum = self.mass * self.velocity;
        [true; 2]
    }

    /// The difference of the eccentricity vectors times the distance, and the difference of the angular momenta divided
    /// by the distance.
    fn miss(&self, end: &BodyState) -> SVector<f64, 6> {
        let found = self.elements(&end.position, &end.linear_momentum);
        let wanted = self.elements(&self.position, &(self.mass * self.velocity));
        let distance = (self.position - self.center).norm();
        let parts = [
            (found[0] - wanted[0]) * distance,
            (found[1] - wanted[1]) / distance,
        ];
        SVector::from_fn(|row, _| parts[row / 3][row % 3])
    }
}
