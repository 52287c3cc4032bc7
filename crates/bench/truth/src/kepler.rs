//! Kepler orbits and their motion in closed form.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

use crate::double_double::DoubleDouble;
use crate::random::Random;

/// A state on a Kepler orbit about the origin, with `GM = 1`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Orbit {
    pub position: Vector3<f64>,
    pub velocity: Vector3<f64>,
    semi_major_axis: f64,
    eccentricity: f64,
}

impl Orbit {
    /// Draws an orbit: semi-major axis log-uniform in 1 … 2.5, eccentricity uniform in 0 … 0.5, plane, periapsis and
    /// mean anomaly uniform.
    pub(crate) fn random(random: &mut Random) -> Self {
        let semi_major_axis = random.log_uniform(1.0, 2.5);
        let eccentricity = random.uniform(0.0, 0.5);
        let frame = random.rotation();
        let (sin, cos) = {
            let anomaly = eccentric_anomaly(random.uniform(0.0, TAU), eccentricity);
            (libm::sin(anomaly), libm::cos(anomaly))
        };
        let minor = (1.0 - eccentricity * eccentricity).sqrt();
        let rate = 1.0 / ((1.0 - eccentricity * cos) * semi_major_axis.sqrt());
        Self {
            position: frame * Vector3::new(cos - eccentricity, minor * sin, 0.0) * semi_major_axis,
            velocity: frame * Vector3::new(-sin, minor * cos, 0.0) * rate,
            semi_major_axis,
            eccentricity,
        }
    }

    /// Returns the mean motion.
    pub(crate) fn rate(&self) -> f64 {
        1.0 / (self.semi_major_axis * self.semi_major_axis.sqrt())
    }

    /// Returns the distance at periapsis.
    pub(crate) fn periapsis(&self) -> f64 {
        self.semi_major_axis * (1.0 - self.eccentricity)
    }

    /// Returns the unit vectors along the velocity, across it in the orbital plane, and along the normal. They are
    /// right-handed.
    pub(crate) fn axes(&self) -> [Vector3<f64>; 3] {
        let along = self.velocity.normalize();
        let normal = self.position.cross(&self.velocity).normalize();
        [along, normal.cross(&along), normal]
    }
}

/// Solves Kepler's equation `E − e sin E = M` for `E` by Newton's method. The initial guess π converges for all `M` and
/// `e < 1`.
pub(crate) fn eccentric_anomaly(mean: f64, eccentricity: f64) -> f64 {
    let mut anomaly = std::f64::consts::PI;
    for _ in 0..50 {
        let residual = anomaly - eccentricity * libm::sin(anomaly) - mean;
        let step = residual / (1.0 - eccentricity * libm::cos(anomaly));
        anomaly -= step;
        if step.abs() < 1e-14 {
            break;
        }
    }
    anomaly
}

/// Returns the position after time `t` on an elliptic Kepler orbit about the origin. The result is exact except for
/// rounding errors for any number of revolutions, because the mean anomaly is computed in double-double precision.
///
/// # Assumptions and limitations
/// The orbit is an ellipse.
pub fn position(gm: f64, x: &Vector3<f64>, v: &Vector3<f64>, t: f64) -> Vector3<f64> {
    let exact = DoubleDouble::from;
    let dot = |a: &Vector3<f64>, b: &Vector3<f64>| {
        (0..3).fold(exact(0.0), |sum, i| sum + exact(a[i]) * exact(b[i]))
    };
    let gm = exact(gm);
    let radius = dot(x, x).square_root();
    let curvature = exact(2.0) * radius.reciprocal() - dot(v, v) * gm.reciprocal();
    let rate = (gm * curvature).square_root() * curvature;
    let mean = (rate * exact(t)).reduced();
    // 1 − e cos E and e sin E at the start
    let (from_one, sine) = (
        (radius * curvature).0,
        (dot(x, v) * (curvature * gm.reciprocal()).square_root()).0,
    );
    let cosine = 1.0 - from_one;
    let residual = |turn: f64| {
        let half = libm::sin(0.5 * turn);
        let excess = turn - libm::sin(turn);
        excess * cosine + turn * from_one + 2.0 * sine * half * half - mean
    };
    let (mut low, mut high) = (mean - 2.0, mean + 2.0);
    let mut turn = mean;
    for _ in 0..200 {
        let value = residual(turn);
        if value > 0.0 {
            high = turn;
        } else {
            low = turn;
        }
        let slope = 1.0 - cosine * libm::cos(turn) + sine * libm::sin(turn);
        let next = turn - value / slope;
        let next = if next > low && next < high {
            next
        } else {
            0.5 * (low + high)
        };
        let change = next - turn;
        turn = next;
        if change.abs() <= f64::EPSILON * turn.abs() {
            break;
        }
    }
    let half = libm::sin(0.5 * turn);
    let f = 1.0 - 2.0 * half * half / from_one;
    let g = (mean - (turn - libm::sin(turn))) / rate.0;
    x * f + v * g
}

/// Returns the attitude of a sphere after it has turned with a constant angular velocity (body frame) for time `t`. The
/// result is exact except for rounding errors for any number of revolutions.
pub fn spun(attitude: &Matrix3<f64>, spin: &Vector3<f64>, t: f64) -> Matrix3<f64> {
    let exact = DoubleDouble::from;
    let squared = (0..3).fold(exact(0.0), |sum, i| sum + exact(spin[i]) * exact(spin[i]));
    if squared.0 == 0.0 {
        return *attitude;
    }
    let turn = (squared.square_root() * exact(t)).reduced();
    attitude * lgvi_lie::exp(&(turn * spin.normalize()))
}
