use std::f64::consts::PI;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use super::sight::Sight;
use super::{BySecond, Coordinates, Region, StateConstraint};
use crate::problem::ParameterError;
use crate::problem::parameter::{angle, direction, length, point};

/// A point that must not be within an angle of a body axis and nearer than a distance, such as in the plume of a thruster:
/// `g = A + B − √(A² + B² + ε²)` with `A = (R a · u − cos α)/sin α` and `B = 1 − r/d`.
///
/// `g` is positive where both `A` and `B` are. The edge is rounded off by `ε = 1e-6`: there, points are allowed that are
/// inside by up to that part of the distance and of a radian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plume {
    axis: Vector3<f64>,
    point: Vector3<f64>,
    half_angle: f64,
    distance: f64,
    cosine: f64,
    sine: f64,
}

/// `ε`
const ROUNDING: f64 = 1e-6;

impl Plume {
    /// The constraint for a plume from the center of mass along the body axis `axis`, of any length but zero, with a
    /// half-angle in `(0, π)` (rad), that must not reach `point` (inertial frame) from less than a positive `distance`.
    pub fn new(
        axis: Vector3<f64>,
        at: Vector3<f64>,
        half_angle: f64,
        distance: f64,
    ) -> Result<Self, ParameterError> {
        let half_angle = angle(half_angle, PI, "π")?;
        Ok(Self {
            axis: direction("axis", axis)?,
            point: point("point", at)?,
            half_angle,
            distance: length("distance", distance)?,
            cosine: libm::cos(half_angle),
            sine: libm::sin(half_angle),
        })
    }

    /// The unit vector of the axis in the body frame.
    pub fn axis(&self) -> Vector3<f64> {
        self.axis
    }

    /// The point in the inertial frame.
    pub fn point(&self) -> Vector3<f64> {
        self.point
    }

    /// The half-angle (rad).
    pub fn half_angle(&self) -> f64 {
        self.half_angle
    }

    /// The distance.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    fn sight<'s>(&self, state: &'s BodyState) -> Sight<'s> {
        Sight::new(state, &self.axis, &self.point)
    }

    fn edge(&self, sight: &Sight<'_>) -> Edge {
        Edge::new(
            (sight.cosine - self.cosine) / self.sine,
            1.0 - sight.distance / self.distance,
        )
    }
}

/// `g` with its derivatives by `A` and `B`.
struct Edge {
    value: f64,
    first: [f64; 2],
    /// By `A` twice, by both, by `B` twice.
    second: [f64; 3],
}

impl Edge {
    fn new(a: f64, b: f64) -> Self {
        let root = (a * a + b * b + ROUNDING * ROUNDING).sqrt();
        let cube = root * root * root;
        // Both are `a + b − root`; the second does not cancel where g is about 0.
        let value = if a + b > 0.0 {
            (2.0 * a * b - ROUNDING * ROUNDING) / (a + b + root)
        } else {
            a + b - root
        };
        Self {
            value,
            first: [1.0 - a / root, 1.0 - b / root],
            second: [
                -(b * b + ROUNDING * ROUNDING) / cube,
                a * b / cube,
                -(a * a + ROUNDING * ROUNDING) / cube,
            ],
        }
    }
}

impl StateConstraint for Plume {
    fn name(&self) -> &'static str {
        "plume"
    }

    fn region(&self) -> Option<Region> {
        Some(Region::OutsidePlume {
            axis: self.axis,
            point: self.point,
            half_angle: self.half_angle,
            distance: self.distance,
        })
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::Pose
    }

    fn value(&self, state: &BodyState) -> f64 {
        self.edge(&self.sight(state)).value
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let sight = self.sight(state);
        let Edge { first, second, .. } = self.edge(&sight);
        let (cosine, cosine_twice) = sight.by_position();
        let (distance, distance_twice) = sight.distance_by_position();
        let (a, b) = (cosine / self.sine, distance / -self.distance);
        let mixed = second[1] * a * b.transpose();
        let hessian = first[0] / self.sine * cosine_twice
            - first[1] / self.distance * distance_twice
            + second[0] * a * a.transpose()
            + mixed
            + mixed.transpose()
            + second[2] * b * b.transpose();
        (first[0] * a + first[1] * b, hessian)
    }

    fn by_second(&self, state: &BodyState) -> Option<BySecond> {
        let sight = self.sight(state);
        let Edge { first, second, .. } = self.edge(&sight);
        let cosine = sight.by_attitude();
        let by_position = sight.by_position().0 / self.sine;
        let (distance, _) = sight.distance_by_position();
        let along = second[0] * by_position - second[1] / self.distance * distance;
        let gradient = cosine.gradient / self.sine;
        let share = first[0] / self.sine;
        Some(BySecond {
            gradient: first[0] * gradient,
            hessian: share * cosine.hessian + second[0] * gradient * gradient.transpose(),
            mixed: share * cosine.mixed + along * gradient.transpose(),
        })
    }

    fn size(&self) -> f64 {
        1.0
    }
}
