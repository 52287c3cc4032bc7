//! Kepler orbits: a state from orbital elements.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

/// A point of a Kepler orbit of any eccentricity, by its elements. Angles are in rad, from the x axis of the inertial
/// frame and its xy plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elements {
    /// Distance of the periapsis from the center, > 0.
    pub periapsis: f64,
    /// Eccentricity, ≥ 0.
    pub eccentricity: f64,
    /// Inclination.
    pub inclination: f64,
    /// Right ascension of the ascending node.
    pub raan: f64,
    /// Argument of the periapsis.
    pub argument_of_periapsis: f64,
    /// True anomaly.
    pub true_anomaly: f64,
}

impl Elements {
    /// Returns position and velocity relative to the center, inertial axes, for the gravitational parameter `gm`.
    pub(crate) fn state(&self, gm: f64) -> [Vector3<f64>; 2] {
        let (sin, cos) = (libm::sin(self.true_anomaly), libm::cos(self.true_anomaly));
        let parameter = self.periapsis * (1.0 + self.eccentricity);
        let distance = parameter / (1.0 + self.eccentricity * cos);
        let speed = (gm / parameter).sqrt();
        let [p, q] = self.perifocal();
        [
            distance * (cos * p + sin * q),
            speed * ((self.eccentricity + cos) * q - sin * p),
        ]
    }

    /// Returns the unit vectors to the periapsis, and along the motion there.
    fn perifocal(&self) -> [Vector3<f64>; 2] {
        let [(si, ci), (sn, cn), (sw, cw)] =
            [self.inclination, self.raan, self.argument_of_periapsis]
                .map(|angle| (libm::sin(angle), libm::cos(angle)));
        [
            Vector3::new(cn * cw - sn * sw * ci, sn * cw + cn * sw * ci, sw * si),
            Vector3::new(-cn * sw - sn * cw * ci, cn * cw * ci - sn * sw, cw * si),
        ]
    }
}

/// Largest number of Newton steps. They approach the root from one side, and more than 60 have not been seen.
const MOST: usize = 200;

/// Returns the true anomaly of an orbit of eccentricity `e` ≥ 0, `e` ≠ 1, at a mean anomaly (rad): Kepler's equation.
pub(crate) fn true_anomaly(e: f64, mean: f64) -> f64 {
    if e < 1.0 {
        let turns = (mean / TAU).round();
        let mean = mean - turns * TAU;
        let eccentric = mean.signum() * eccentric_anomaly(e, mean.abs().min(PI));
        let half = 0.5 * eccentric;
        2.0 * libm::atan2(
            (1.0 + e).sqrt() * libm::sin(half),
            (1.0 - e).sqrt() * libm::cos(half),
        )
    } else {
        let half = 0.5 * mean.signum() * hyperbolic_anomaly(e, mean.abs());
        2.0 * libm::atan(((e + 1.0) / (e - 1.0)).sqrt() * libm::tanh(half))
    }
}

/// Solves `E − e sin E = M` for `0 ≤ M ≤ π`. The left side is convex there and the start is above the root, so that
/// Newton's steps fall until rounding stops them.
fn eccentric_anomaly(e: f64, mean: f64) -> f64 {
    let start = (mean + e).min(mean / (1.0 - e)).min(PI);
    descend(start, |at| {
        (at - e * libm::sin(at) - mean, 1.0 - e * libm::cos(at))
    })
}

/// Solves `e sinh H − H = M` for `M ≥ 0`, likewise. The start is above the root as `sinh H ≥ H + H³/6`, and as `sinh H ≥
/// 2 H` where `H ≥ 2.2`.
fn hyperbolic_anomaly(e: f64, mean: f64) -> f64 {
    let start = (mean / (e - 1.0)).min(libm::cbrt(6.0 * mean / e));
    let start = start.min(libm::asinh(2.0 * mean / e).max(2.2));
    descend(start, |at| {
        (e * libm::sinh(at) - at - mean, e * libm::cosh(at) - 1.0)
    })
}

/// Newton's method from above the root of a convex rising function, given with its slope.
fn descend(start: f64, function: impl Fn(f64) -> (f64, f64)) -> f64 {
    let mut at = start;
    for _ in 0..MOST {
        let (value, slope) = function(at);
        let next = at - value / slope;
        if next >= at || next.is_nan() {
            break;
        }
        at = next;
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vallado, Fundamentals of Astrodynamics and Applications, examples 2-1 and 2-3.
    #[test]
    fn published_anomalies_are_found() {
        let mean = 235.4_f64.to_radians();
        let eccentric = TAU - eccentric_anomaly(0.4, TAU - mean);
        assert!(
            (eccentric.to_degrees() - 220.512_074).abs() < 1e-6,
            "{eccentric}"
        );
        let hyperbolic = hyperbolic_anomaly(2.4, mean);
        assert!((hyperbolic - 1.601_376_1).abs() < 1e-7, "{hyperbolic}");
    }

    /// Kepler's equation holds to rounding of its terms, near the parabola and for large anomalies too.
    #[test]
    fn anomalies_satisfy_the_equation_of_kepler() {
        for e in [0.0, 1e-9, 0.1, 0.7, 0.99, 1.0 - 1e-9] {
            for mean in [0.0, 1e-12, 1e-3, 0.5, 2.0, 3.1, PI] {
                let at = eccentric_anomaly(e, mean);
                let error = at - e * libm::sin(at) - mean;
                assert!(
                    error.abs() <= 4.0 * f64::EPSILON * at,
                    "{e} {mean}: {error:e}"
                );
            }
        }
        for e in [1.0 + 1e-9, 1.01, 1.5, 20.0, 1e6] {
            for mean in [0.0, 1e-12, 1e-3, 0.5, 30.0, 1e8, 1e100] {
                let at = hyperbolic_anomaly(e, mean);
                let error = e * libm::sinh(at) - at - mean;
                let size = e * libm::cosh(at) * at + mean;
                assert!(
                    error.abs() <= 4.0 * f64::EPSILON * size,
                    "{e} {mean}: {error:e}"
                );
            }
        }
    }
}
