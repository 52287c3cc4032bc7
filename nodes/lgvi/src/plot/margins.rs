//! How near a flight came to the bounds of its states.

use std::f64::consts::FRAC_PI_2;

use lgvi_control::Constraint;
use lgvi_control::constraint::Region;
use lgvi_scene::Units;
use nalgebra::Vector3;

use super::data::{FlightData, Pose, Sample};
use super::limits;
use super::series::turned;

/// What a constraint bounds, over time.
pub(crate) struct Margin {
    pub(crate) title: &'static str,
    /// SI, or degrees; empty where there is none.
    pub(crate) unit: &'static str,
    pub(crate) bound: f64,
    /// Whether the values are to be above the bound, not below.
    pub(crate) is_least: bool,
    /// Whether a violation has a price instead of being forbidden.
    pub(crate) is_soft: bool,
    /// One a sample.
    pub(crate) values: Vec<f64>,
}

impl Margin {
    /// That of a constraint on states, if it can be drawn.
    pub(crate) fn of<'s>(
        flight: &FlightData,
        constraint: &Constraint,
        samples: impl IntoIterator<Item = &'s Sample>,
    ) -> Option<Self> {
        let scene = &flight.scene;
        let body = turned(flight);
        let measured = |sample: &Sample| {
            let region = constraint.region_at(scene.h() * sample.step as f64)?;
            Some(Measure::of(&region, &sample.bodies[body], &scene.units))
        };
        let measures = samples.into_iter().map(measured);
        let measures: Vec<_> = measures.collect::<Option<_>>()?;
        let first = measures.first()?;
        Some(Self {
            title: first.title,
            unit: first.unit,
            bound: first.bound,
            is_least: first.is_least,
            is_soft: constraint.price().is_some(),
            values: measures.iter().map(|measure| measure.value).collect(),
        })
    }
}

/// Those of all constraints of a flight's maneuver.
pub(super) fn margins(flight: &FlightData) -> impl Iterator<Item = Margin> {
    limits::constraints(flight)
        .filter_map(|constraint| Margin::of(flight, constraint, &flight.samples))
}

/// The value at one state of what a constraint bounds.
struct Measure {
    title: &'static str,
    unit: &'static str,
    value: f64,
    bound: f64,
    is_least: bool,
}

impl Measure {
    fn most(title: &'static str, unit: &'static str, value: f64, bound: f64) -> Self {
        Self {
            title,
            unit,
            value,
            bound,
            is_least: false,
        }
    }

    fn least(title: &'static str, unit: &'static str, value: f64, bound: f64) -> Self {
        Self {
            is_least: true,
            ..Self::most(title, unit, value, bound)
        }
    }

    /// In a region of the inertial frame, in the scene's units.
    fn of(region: &Region, pose: &Pose, units: &Units) -> Self {
        let length = units.length;
        let arm = |point: &Vector3<f64>| pose.position - point * length;
        match region {
            Region::OutsideEllipsoid {
                center, semi_axes, ..
            } if semi_axes.max() == semi_axes.min() => {
                let title = "Distance from the center of the keep-out sphere";
                Self::least(title, "m", arm(center).norm(), semi_axes.x * length)
            }
            Region::OutsideEllipsoid {
                center,
                semi_axes,
                axes,
            } => {
                let title = "Distance from the keep-out ellipsoid's center, in its radius";
                let arm = axes.tr_mul(&arm(center)) / length;
                Self::least(title, "", arm.component_div(semi_axes).norm(), 1.0)
            }
            Region::Corridor {
                apex,
                axis,
                half_angle,
            } => {
                let title = "Angle from the axis of the corridor";
                let angle = angle(&arm(apex), axis).to_degrees();
                Self::most(title, "°", angle, half_angle.to_degrees())
            }
            Region::OutsideCone {
                axis,
                direction,
                half_angle,
            } => {
                let title = "Angle from the axis of the keep-out cone";
                let angle = angle(&(pose.attitude * axis), direction).to_degrees();
                Self::least(title, "°", angle, half_angle.to_degrees())
            }
            Region::InSight {
                axis,
                point,
                half_angle,
            } => {
                let title = "Angle between the axis and the line of sight";
                let angle = in_view(&arm(point), pose, axis).to_degrees();
                Self::most(title, "°", angle, half_angle.to_degrees())
            }
            Region::OutsidePlume {
                axis,
                point,
                half_angle,
                distance,
            } => {
                let title = "Plume: larger of the point's relative angle and distance";
                let arm = arm(point);
                let angle = in_view(&arm, pose, axis) / half_angle;
                Self::least(title, "", angle.max(arm.norm() / (distance * length)), 1.0)
            }
            Region::AngularRate { axis: None, limit } => {
                let rate = pose.rate.norm();
                Self::most("Angular rate", "rad/s", rate, limit / units.time)
            }
            Region::AngularRate {
                axis: Some(axis),
                limit,
            } => {
                let rate = pose.rate.dot(axis).abs();
                let title = "Angular rate about the limited axis";
                Self::most(title, "rad/s", rate, limit / units.time)
            }
            Region::Speed { limit } => {
                let speed = pose.velocity.norm();
                Self::most("Speed", "m/s", speed, limit * length / units.time)
            }
        }
    }
}

/// The angle between an axis of the body and the direction to a point, from which the body is `arm` away. At the point itself it is
/// a right angle, as in the constraint.
fn in_view(arm: &Vector3<f64>, pose: &Pose, axis: &Vector3<f64>) -> f64 {
    match (-arm).try_normalize(0.0) {
        Some(direction) => angle(&(pose.attitude * axis), &direction),
        None => FRAC_PI_2,
    }
}

/// Between two vectors, the second a unit one (rad).
fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    libm::atan2(a.cross(b).norm(), a.dot(b))
}
