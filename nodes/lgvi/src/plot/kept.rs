//! Energy and angular momentum. What the equations of motion keep in this flight has an error, other changes are no errors.

use lgvi_dynamics::Mobility;
use nalgebra::Vector3;

use super::data::{FlightData, Sample};
use super::series::{AXES, Curve, Panel, over_time, plain};
use super::style;

/// What is kept of the angular momentum about the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Momentum {
    All,
    /// Its component along this unit vector.
    Along(Vector3<f64>),
    Nothing,
}

/// Whether the total energy is kept: nothing acts on the bodies from outside that depends on time, none dock, and none have drag.
pub(super) fn energy(flight: &FlightData) -> bool {
    let mut bodies = flight.scene.bodies.iter();
    !flight.is_disturbed()
        && !flight.scene.has_drag()
        && flight.scene.docking.is_empty()
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
    if flight.is_disturbed() || scene.has_drag() || held || aside {
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

/// The energies, or what goes from one to the other.
pub(super) fn energies(flight: &FlightData) -> Panel {
    let curve = |label: &str, color, value: fn(&Sample) -> f64| Curve {
        label: label.into(),
        color,
        points: over_time(flight, value),
    };
    let [translation, rotation, potential] = style::ENERGIES;
    let bodies = &mut flight.scene.bodies.iter();
    let pivoted = bodies.all(|named| *named.body.mobility() == Mobility::Pivoted);
    let mut curves = Vec::new();
    if !pivoted {
        curves.push(curve("translation", translation, |sample| {
            sample.energy.translation
        }));
    }
    curves.extend([
        curve("rotation", rotation, |sample| sample.energy.rotation),
        curve("potential", potential, |sample| sample.energy.potential),
        curve("total", style::INK, |sample| sample.energy.total),
    ]);
    Panel::new("Energy", "J", curves).or_changes("Energy, change from the start")
}

/// An error where the flight keeps its energy, relative if it is not zero.
pub(super) fn energy_change(flight: &FlightData) -> Panel {
    let start = flight.first().energy.total;
    let kept = energy(flight);
    let change = |scale: f64| {
        let points = over_time(flight, |sample| (sample.energy.total - start) / scale);
        vec![plain(points)]
    };
    match (kept, start) {
        (false, _) => Panel::new("Energy change E − E₀", "J", change(1.0)),
        (true, 0.0) => Panel::new("Energy error E − E₀", "J", change(1.0)),
        (true, _) => Panel::new("Energy error (E − E₀)/|E₀|", "", change(start.abs())),
    }
}

/// Likewise, of that part of the angular momentum about the origin which the flight keeps.
pub(super) fn momentum_change(flight: &FlightData) -> Panel {
    let start = flight.first().angular_momentum;
    let kept = momentum(flight);
    let value = |vector: &Vector3<f64>| match kept {
        Momentum::Along(axis) => vector.dot(&axis),
        Momentum::All | Momentum::Nothing => vector.norm(),
    };
    let size = value(&start).abs();
    // What is only rounding is no measure.
    let relative = kept != Momentum::Nothing && size > 1e-9 * start.norm();
    let scale = if relative { size } else { 1.0 };
    let title = match kept {
        Momentum::All => "Angular momentum error |L − L₀|".into(),
        Momentum::Along(axis) => format!("Angular momentum error {}", along(&axis)),
        Momentum::Nothing => "Angular momentum change |L − L₀|".into(),
    };
    let (by, unit) = match (relative, kept) {
        (true, Momentum::Along(_)) => (", relative", ""),
        (true, _) => ("/|L₀|", ""),
        (false, _) => ("", "kg m²/s"),
    };
    let points = over_time(flight, |sample| {
        value(&(sample.angular_momentum - start)) / scale
    });
    Panel::new(title + by, unit, vec![plain(points)])
}

/// The component that is meant: `L_z − L_z₀`, or that along a field's axis.
fn along(axis: &Vector3<f64>) -> String {
    match (0..3).find(|i| axis[*i].abs() > 1.0 - 1e-12) {
        Some(i) => format!("about {}, (L − L₀)", AXES[i]),
        None => "about the field's axis, (L − L₀)".into(),
    }
}
