//! Where a maneuver comes from and goes to.

use lgvi_control::Place;
use nalgebra::Vector3;

use super::data::FlightData;
use super::orbit::Orbit;

/// How far orbits are drawn, in terms of the flight's greatest distance.
const CLOSED: f64 = 2.5;
const OPEN: f64 = 1.0;

/// The orbits before and after a maneuver.
pub(crate) struct Orbits {
    pub(crate) initial: Orbit,
    /// None where the target is no orbit.
    pub(crate) target: Option<Orbit>,
    /// The attractor, inertial frame (m).
    center: Vector3<f64>,
    /// Farthest that the flight gets from the attractor (m).
    farthest: f64,
}

impl Orbits {
    pub(crate) fn of(flight: &FlightData) -> Option<Self> {
        let scene = &flight.scene;
        let units = &scene.units;
        let central = scene.gravity.central.as_ref()?;
        let gm = central.gm * units.length.powi(3) / (units.time * units.time);
        let center = central.position * units.length;
        let maneuver = scene.maneuver.as_ref()?;
        let named = &scene.bodies[maneuver.body];
        let orbit = |position: &Vector3<f64>, linear_momentum: &Vector3<f64>| {
            let velocity = linear_momentum * (units.length / units.time / named.body.mass());
            Orbit::osculating(&(position * units.length - center), &velocity, gm)
        };
        let mut end = named.state;
        let target = maneuver
            .target
            .condition(Place::Position)
            .is_some_and(|condition| condition.aim(&mut end) == [true; 2])
            .then(|| orbit(&end.position, &end.linear_momentum))
            .flatten();
        let positions = flight
            .samples
            .iter()
            .map(|sample| sample.bodies[maneuver.body].position - center);
        Some(Self {
            initial: orbit(&named.state.position, &named.state.linear_momentum)?,
            target,
            center,
            farthest: positions
                .map(|position| position.norm())
                .fold(0.0, f64::max),
        })
    }

    pub(crate) fn points(&self, orbit: &Orbit) -> Vec<Vector3<f64>> {
        let reach = self.farthest * if self.close(orbit) { CLOSED } else { OPEN };
        let points = orbit.points(reach).into_iter();
        points.map(|point| point + self.center).collect()
    }

    /// Whether an orbit is drawn whole.
    pub(crate) fn close(&self, orbit: &Orbit) -> bool {
        orbit.closes_within(CLOSED * self.farthest)
    }

    /// Angle between the initial plane and another's [°].
    pub(crate) fn plane_change(&self, target: &Orbit) -> f64 {
        let cos = self.initial.normal().dot(&target.normal());
        libm::acos(cos.clamp(-1.0, 1.0)).to_degrees()
    }
}
