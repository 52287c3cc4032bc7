//! What the equations of motion keep in this flight: only of that a deviation is an error.

use lgvi_dynamics::Mobility;
use nalgebra::Vector3;

use super::data::FlightData;

/// What is kept of the angular momentum about the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Momentum {
    All,
    /// Its component along this unit vector.
    Along(Vector3<f64>),
    Nothing,
}

/// Whether the total energy is kept: nothing acts on the bodies from outside that depends on time.
pub(super) fn energy(flight: &FlightData) -> bool {
    let mut bodies = flight.scene.bodies.iter();
    !flight.is_disturbed()
        && !bodies.any(|named| matches!(named.body.mobility(), Mobility::Driven(_)))
}

/// A field that is symmetric about an axis through the origin keeps the momentum along it.
pub(super) fn momentum(flight: &FlightData) -> Momentum {
    let scene = &flight.scene;
    let held = scene
        .bodies
        .iter()
        .any(|named| match named.body.mobility() {
            Mobility::Free => false,
            // What holds a pivot at the origin has no moment about it.
            Mobility::Pivoted => named.state.position != Vector3::zeros(),
            Mobility::Fixed | Mobility::Driven(_) => true,
        });
    let central = scene.gravity.central.as_ref();
    let aside = central.is_some_and(|central| central.position != Vector3::zeros());
    if flight.is_disturbed() || held || aside {
        return Momentum::Nothing;
    }
    let pole = central.and_then(|central| Some(central.oblateness?.pole));
    let gravity = scene.gravity.uniform.and_then(|g| g.try_normalize(0.0));
    match (pole, gravity) {
        (None, None) => Momentum::All,
        (Some(axis), None) | (None, Some(axis)) => Momentum::Along(axis),
        (Some(pole), Some(gravity)) if pole.cross(&gravity).norm() < 1e-12 => Momentum::Along(pole),
        (Some(_), Some(_)) => Momentum::Nothing,
    }
}
