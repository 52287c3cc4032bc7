//! The Kepler orbit that a state lies on.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

/// The osculating conic of a point about an attractor at the origin; SI.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Orbit {
    /// Semi-latus rectum (m).
    pub(crate) parameter: f64,
    pub(crate) eccentricity: f64,
    /// Towards the periapsis, unit; for a circle towards the state itself.
    periapsis: Vector3<f64>,
    /// In the plane, a quarter turn ahead of the periapsis, unit.
    ahead: Vector3<f64>,
    /// True anomaly of the state (rad).
    anomaly: f64,
}

/// Below this a direction of the periapsis is rounding.
const CIRCULAR: f64 = 1e-9;

/// How far beyond the periapsis an open orbit is shown (rad).
const PAST: f64 = 0.5;

/// Points of an orbit.
const POINTS: u32 = 180;

impl Orbit {
    /// From position (m), velocity (m/s) and `GM` [m³/s²]; `None` on a straight line through the attractor.
    pub(crate) fn osculating(
        position: &Vector3<f64>,
        velocity: &Vector3<f64>,
        gm: f64,
    ) -> Option<Self> {
        let momentum = position.cross(velocity);
        let distance = position.norm();
        let normal = momentum.try_normalize(1e-12 * distance * velocity.norm())?;
        let vector = velocity.cross(&momentum) / gm - position / distance;
        let eccentricity = vector.norm();
        let periapsis = if eccentricity < CIRCULAR {
            position / distance
        } else {
            vector / eccentricity
        };
        let ahead = normal.cross(&periapsis);
        Some(Self {
            parameter: momentum.norm_squared() / gm,
            eccentricity,
            anomaly: libm::atan2(position.dot(&ahead), position.dot(&periapsis)),
            periapsis,
            ahead,
        })
    }

    /// Normal of the plane, along the angular momentum, unit.
    pub(crate) fn normal(&self) -> Vector3<f64> {
        self.periapsis.cross(&self.ahead)
    }

    /// The point at a true anomaly.
    fn at(&self, anomaly: f64) -> Vector3<f64> {
        let (sin, cos) = libm::sincos(anomaly);
        let distance = self.parameter / (1.0 + self.eccentricity * cos);
        distance * (cos * self.periapsis + sin * self.ahead)
    }

    /// Whether it is an ellipse that lies within `reach` (m) of the attractor.
    pub(crate) fn closes_within(&self, reach: f64) -> bool {
        self.eccentricity < 1.0 && self.parameter <= reach * (1.0 - self.eccentricity)
    }

    /// The orbit as far as it lies within `reach` (m) of the attractor: whole where it closes, else from the state on,
    /// to shortly after the periapsis or, from beyond that, until it leaves.
    pub(crate) fn points(&self, reach: f64) -> Vec<Vector3<f64>> {
        let (from, to) = if self.closes_within(reach) {
            (self.anomaly, self.anomaly + TAU)
        } else {
            let cos = (self.parameter / reach - 1.0) / self.eccentricity;
            let leaves = libm::acos(cos.clamp(-1.0, 1.0)).min(PI);
            let end = if self.anomaly < PAST {
                leaves.min(PAST)
            } else {
                leaves
            };
            (self.anomaly, self.anomaly.max(end))
        };
        (0..=POINTS)
            .map(|k| self.at(from + (to - from) * f64::from(k) / f64::from(POINTS)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vallado, *Fundamentals of Astrodynamics*, example 2-5: p = 11 067.790 km, e = 0.832 853, i = 87.870°, ν = 92.335°.
    #[test]
    fn a_textbook_state_has_the_textbook_orbit() {
        let position = Vector3::new(6_524_834.0, 6_862_875.0, 6_448_296.0);
        let velocity = Vector3::new(4_901.327, 5_533.756, -1_976.341);
        let orbit = Orbit::osculating(&position, &velocity, 3.986_004_418e14).unwrap();
        assert!((orbit.parameter - 11_067_790.0).abs() < 200.0, "{orbit:?}");
        assert!((orbit.eccentricity - 0.832_853).abs() < 1e-5, "{orbit:?}");
        assert!(
            (orbit.anomaly.to_degrees() - 92.335).abs() < 1e-3,
            "{orbit:?}"
        );
        let inclination = libm::acos(orbit.normal().z).to_degrees();
        assert!((inclination - 87.870).abs() < 1e-3, "{inclination}");
        assert!((orbit.at(orbit.anomaly) - position).norm() < 1e-6 * position.norm());
    }

    #[test]
    fn an_ellipse_is_whole_and_keeps_its_apses() {
        // Periapsis at distance 1 with v² = (1 + e) GM / r: e = 0.5, apoapsis at 3.
        let position = Vector3::new(0.0, 1.0, 0.0);
        let velocity = Vector3::new(0.0, 0.0, libm::sqrt(1.5 * 4.0));
        let orbit = Orbit::osculating(&position, &velocity, 4.0).unwrap();
        assert!(orbit.closes_within(3.01) && !orbit.closes_within(2.99));
        let points = orbit.points(3.01);
        assert!((points[0] - points[points.len() - 1]).norm() < 1e-12);
        let distances = || points.iter().map(Vector3::norm);
        assert!((distances().fold(f64::INFINITY, f64::min) - 1.0).abs() < 1e-12);
        assert!((distances().fold(0.0, f64::max) - 3.0).abs() < 1e-12);
        assert!(
            points.iter().all(|point| point.x.abs() < 1e-12),
            "in its plane"
        );
        assert!(
            orbit
                .points(2.0)
                .iter()
                .all(|point| point.norm() < 2.0 + 1e-12)
        );
    }

    #[test]
    fn a_circle_starts_at_the_state_and_a_hyperbola_ends_past_its_periapsis() {
        let (x, y) = (Vector3::<f64>::x(), Vector3::<f64>::y());
        let circle = Orbit::osculating(&(2.0 * x), &(libm::sqrt(0.5) * y), 1.0).unwrap();
        assert!((circle.points(2.1)[0] - 2.0 * x).norm() < 1e-12);
        assert!(
            circle
                .points(2.1)
                .iter()
                .all(|point| (point.norm() - 2.0).abs() < 1e-9)
        );

        let hyperbola = Orbit::osculating(&(-5.0 * x + y), &(2.0 * x), 1.0).unwrap();
        assert!(hyperbola.eccentricity > 1.0);
        let points = hyperbola.points(6.0);
        assert!((points[0] - (-5.0 * x + y)).norm() < 1e-9);
        let distances: Vec<_> = points.iter().map(Vector3::norm).collect();
        let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
        let periapsis = hyperbola.parameter / (1.0 + hyperbola.eccentricity);
        assert!(
            (least / periapsis - 1.0).abs() < 1e-3,
            "passes the periapsis"
        );
        assert!(
            distances[POINTS as usize] < 2.0 * periapsis,
            "and ends soon after"
        );
        let leaving = Orbit::osculating(&(5.0 * x + y), &(2.0 * x), 1.0)
            .unwrap()
            .points(8.0);
        assert!((leaving[POINTS as usize].norm() - 8.0).abs() < 1e-9);

        assert_eq!(Orbit::osculating(&x, &x, 1.0), None, "straight down");
        assert_eq!(
            Orbit::osculating(&x, &Vector3::zeros(), 1.0),
            None,
            "at rest"
        );
    }
}
