//! How near a flight came to the bounds of its states.

use std::f64::consts::FRAC_PI_2;

use lgvi_control::Constraint;
use lgvi_control::constraint::{FrameMotion, Region};
use lgvi_scene::{Maneuver, Units};
use nalgebra::Vector3;

use super::data::{FlightData, Pose, Sample};

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
        body: usize,
        constraint: &Constraint,
        samples: impl IntoIterator<Item = &'s Sample>,
    ) -> Option<Self> {
        let scene = &flight.scene;
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

/// Those of all constraints of a planned body.
pub(super) fn margins(flight: &FlightData, planned: &Maneuver) -> impl Iterator<Item = Margin> {
    let constraints = planned.constraints.iter();
    constraints
        .filter_map(|constraint| Margin::of(flight, planned.body, constraint, &flight.samples))
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
                let title = "Distance in radii of the keep-out ellipsoid";
                let arm = axes.tr_mul(&arm(center)) / length;
                Self::least(title, "", arm.component_div(semi_axes).norm(), 1.0)
            }
            Region::InsideSphere { center, radius } => {
                let title = "Distance from the center of the keep-in sphere";
                Self::most(title, "m", arm(center).norm(), radius * length)
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
                let title = "Plume: larger of relative angle and distance";
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
            Region::Speed { frame, limit } => {
                let unit = length / units.time;
                let there = frame.velocity_at(&(pose.position / length)) * unit;
                let title = if *frame == FrameMotion::INERTIAL {
                    "Speed"
                } else {
                    "Speed relative to the other body"
                };
                Self::most(title, "m/s", (pose.velocity - there).norm(), limit * unit)
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

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = include_str!("../../../../scenes/inspection.toml");

    /// From (32, −3, 3), with the camera along −x, the center is seen at √18 beside 32. The tip of the panel is at (−32, 11, −3) from
    /// there.
    fn away() -> f64 {
        libm::sqrt(32.0 * 32.0 + 11.0 * 11.0 + 9.0)
    }

    #[test]
    fn regions_of_states_are_measured_in_si() {
        for unit in [1.0, 10.0] {
            let units = format!("[units]\nlength = \"{unit} m\"\n[run]");
            let flight = FlightData::flown(&TEXT.replace("[run]", &units), 3, None);
            let beside = libm::atan2(18.0_f64.sqrt(), 32.0).to_degrees();
            let radii = libm::sqrt(16.0 + 9.0 / 196.0 + 9.0 / 64.0);
            let sun = 90.0 + libm::atan(0.1).to_degrees();
            let expected = [
                (radii, 1.0, true),
                (beside, 12.0, false),
                (0.0, 0.016, false),
                (0.0, 0.21 * unit, false),
                (away() / 12.0, 1.0, true),
                (sun, 40.0, true),
            ];
            let found: Vec<_> = margins(&flight, flight.scene.maneuver.as_ref().unwrap()).collect();
            assert_eq!(found.len(), expected.len());
            for (margin, (start, bound, is_least)) in found.iter().zip(expected) {
                let title = margin.title;
                assert_eq!(margin.is_least, is_least, "{title}");
                assert_eq!(margin.values.len(), flight.samples.len(), "{title}");
                let error = (margin.values[0] - start).abs() + (margin.bound - bound).abs();
                assert!(error < 1e-12 * bound.max(start), "{title}: {error}");
            }
            let soft: Vec<_> = found.iter().map(|margin| margin.is_soft).collect();
            assert_eq!(soft, [false, false, false, false, false, true]);
        }
    }

    /// The angle from the plume, along (−1, 0, −1) at the start, counts where the point is near.
    #[test]
    fn a_near_point_is_beside_the_plume() {
        let near = TEXT.replace("distance = 12.0", "distance = 120.0");
        let flight = FlightData::flown(&near, 3, None);
        let plume = margins(&flight, flight.scene.maneuver.as_ref().unwrap())
            .nth(4)
            .unwrap();
        let angle = libm::acos(35.0 / (away() * 2.0_f64.sqrt())).to_degrees() / 60.0;
        assert!(angle > away() / 120.0);
        assert!((plume.values[0] - angle).abs() < 1e-12, "{angle}");
    }
}
