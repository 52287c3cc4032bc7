use std::f64::consts::TAU;

use nalgebra::Vector3;

use crate::random::Random;

/// A place on a Kepler orbit about the origin, `GM = 1`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Orbit {
    pub position: Vector3<f64>,
    pub velocity: Vector3<f64>,
    semi_major_axis: f64,
    eccentricity: f64,
}

impl Orbit {
    /// Semi-major axis log-uniform in 1 … 2.5, eccentricity 0 … 0.5, plane, periapsis and mean anomaly uniform.
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

    /// Mean motion.
    pub(crate) fn rate(&self) -> f64 {
        1.0 / (self.semi_major_axis * self.semi_major_axis.sqrt())
    }

    /// Distance at periapsis.
    pub(crate) fn periapsis(&self) -> f64 {
        self.semi_major_axis * (1.0 - self.eccentricity)
    }

    /// Unit vectors along the velocity, across it in the plane, and along the normal, right-handed.
    pub(crate) fn axes(&self) -> [Vector3<f64>; 3] {
        let along = self.velocity.normalize();
        let normal = self.position.cross(&self.velocity).normalize();
        [along, normal.cross(&along), normal]
    }
}

/// `E` of `E − e sin E = M`, by Newton's method from where it converges for all `M` and `e < 1`.
fn eccentric_anomaly(mean: f64, eccentricity: f64) -> f64 {
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
