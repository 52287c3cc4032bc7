//! What a maneuver must keep to: limits of force and moment, and the regions of its states.

use std::f64::consts::TAU;

use lgvi_control::constraint::{ComponentLimit, Moving, NormLimit, Region};
use lgvi_control::{Constraint, Place};
use lgvi_scene::{Frame, Maneuver};
use nalgebra::Vector3;

use super::data::FlightData;

/// Points of a rim.
const POINTS: u32 = 96;

/// The constraints of the planned bodies that hold all the time.
pub(super) fn constraints(flight: &FlightData) -> impl Iterator<Item = &Constraint> {
    let planned = flight.scene.maneuver.iter().flat_map(Maneuver::planned);
    planned.flat_map(|planned| &planned.constraints)
}

/// The constraints of the planned bodies and of their phases.
fn with_phases(flight: &FlightData) -> impl Iterator<Item = &Constraint> {
    let planned = flight.scene.maneuver.iter().flat_map(Maneuver::planned);
    planned.flat_map(Maneuver::all_constraints)
}

/// Those that are a `T`.
fn all<T: 'static>(flight: &FlightData) -> impl Iterator<Item = &T> {
    constraints(flight).filter_map(Constraint::downcast_ref)
}

/// The states that the constraints allow at the end of the flight.
pub(super) fn regions(flight: &FlightData) -> impl Iterator<Item = Region> {
    with_phases(flight).filter_map(|constraint| constraint.region_at(f64::INFINITY))
}

/// The name in a legend of a kind of constraint. What moves is drawn where it is at the end.
pub(super) fn label(flight: &FlightData, kind: &str, name: &str) -> Option<String> {
    let of_kind = with_phases(flight).filter(|constraint| constraint.name() == kind);
    let found: Vec<_> = of_kind.collect();
    let any_moves = found.iter().any(|constraint| moves(constraint));
    let soft = found.iter().all(|constraint| constraint.price().is_some());
    (!found.is_empty()).then(|| {
        let when = if any_moves { " at the end" } else { "" };
        let soft = if soft { ", soft" } else { "" };
        format!("{name}{when}{soft}")
    })
}

fn moves(constraint: &Constraint) -> bool {
    constraint.downcast_ref::<Moving>().is_some()
}

/// Whether a limit of force or moment has a price.
pub(super) fn is_soft(flight: &FlightData, place: Place) -> bool {
    let mut soft = constraints(flight).filter(|constraint| constraint.price().is_some());
    soft.any(|constraint| constraint.is_on_commands() && constraint.place() == Some(place))
}

/// Limits of the components of force or moment, in the scene's units.
pub(super) fn of_components(flight: &FlightData, place: Place) -> Vec<f64> {
    let limits = all::<ComponentLimit>(flight);
    let limits = limits.filter(|limit| limit.place() == place);
    let limits = limits.flat_map(|limit| limit.limit().data.0[0]);
    let mut limits: Vec<_> = limits.filter(|limit| limit.is_finite()).collect();
    limits.sort_by(f64::total_cmp);
    limits.dedup();
    limits
}

/// The limit of the norm of force or moment, in the scene's units.
pub(super) fn of_norm(flight: &FlightData, place: Place) -> Option<f64> {
    let limits = all::<NormLimit>(flight);
    let limits = limits.filter(|limit| limit.place() == place);
    limits.map(NormLimit::limit).reduce(f64::min)
}

/// The fixed frame nearest to the apex of a corridor that does not move: the port that it leads to.
pub(super) fn port(flight: &FlightData) -> Option<&Frame> {
    let own = flight
        .scene
        .maneuver
        .iter()
        .flat_map(|own| &own.constraints);
    let mut fixed = own.filter(|constraint| !moves(constraint));
    let apex = fixed.find_map(|constraint| match constraint.region() {
        Some(Region::Corridor { apex, .. }) => Some(apex),
        _ => None,
    })?;
    let distance = |frame: &Frame| (frame.position - apex).norm();
    fixed_frames(flight).min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// The scene's frames that are fixed in the inertial one.
pub(super) fn fixed_frames(flight: &FlightData) -> impl Iterator<Item = &Frame> {
    let scene = &flight.scene;
    let frames = scene.frames.iter();
    frames.filter(|frame| frame.parent == scene.frame)
}

/// The rim of a cone, at this distance from its apex, closed.
pub(super) fn rim(
    apex: &Vector3<f64>,
    axis: &Vector3<f64>,
    half_angle: f64,
    reach: f64,
) -> Vec<Vector3<f64>> {
    let (sin, cos) = libm::sincos(half_angle);
    let [u, v] = across(axis);
    let around = |k: u32| {
        let (s, c) = libm::sincos(TAU * f64::from(k) / f64::from(POINTS));
        apex + reach * (cos * axis + sin * (c * u + s * v))
    };
    (0..=POINTS).map(around).collect()
}

/// Two directions that are at right angles to a direction and to each other.
fn across(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let least = Vector3::ith(axis.iamin(), 1.0);
    let u = axis.cross(&least).normalize();
    [u, axis.cross(&u)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rim_is_at_its_angle_and_distance() {
        let (apex, axis) = (Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.6, 0.0, -0.8));
        let rim = rim(&apex, &axis, 0.3, 5.0);
        for point in &rim {
            let arm = point - apex;
            assert!((arm.norm() - 5.0).abs() < 1e-12);
            assert!((libm::acos(arm.dot(&axis) / 5.0) - 0.3).abs() < 1e-12);
        }
        assert!((rim[0] - rim[rim.len() - 1]).norm() < 1e-12, "closed");
    }
}
