//! What a flight is about, which decides what is drawn of it.

use lgvi_control::Motion;
use lgvi_dynamics::Mobility;
use nalgebra::Vector3;

use super::data::FlightData;
use super::proximity::Proximity;

/// What happens in a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Subject {
    /// One body tumbles freely.
    Tumbling,
    /// One body turns where it is.
    Turning,
    /// Bodies stay near each other on a long way together.
    Near,
    /// Bodies move.
    Moving,
}

impl Subject {
    pub(super) fn of(flight: &FlightData) -> Self {
        let scene = &flight.scene;
        if let Some(maneuver) = &scene.maneuver
            && maneuver.motion == Motion::Rotation
        {
            return Self::Turning;
        }
        let [body] = scene.bodies.as_slice() else {
            return match Proximity::of(flight) {
                Some(_) => Self::Near,
                None => Self::Moving,
            };
        };
        let poses = || flight.samples.iter().map(|sample| &sample.bodies[0]);
        let place = flight.first().bodies[0].position;
        if *body.body.mobility() == Mobility::Pivoted || poses().any(|pose| pose.position != place)
        {
            return Self::Moving;
        }
        let free = scene.gravity.is_none()
            && *body.body.mobility() == Mobility::Free
            && !body.body.has_actuators();
        let turns = poses().all(|pose| pose.spin != Vector3::zeros());
        if free && turns && !flight.is_disturbed() {
            Self::Tumbling
        } else {
            Self::Turning
        }
    }
}

/// Most bodies that all have a name and a color.
const MOST: usize = 4;

/// The bodies that a picture names: all of a few, or the heaviest of many with the nearest and the farthest.
pub(super) fn named(flight: &FlightData) -> Vec<usize> {
    let bodies = &flight.scene.bodies;
    if bodies.len() <= MOST {
        return (0..bodies.len()).collect();
    }
    let heaviest = heaviest(flight);
    let distance = |body: usize| -> f64 {
        let apart = flight
            .samples
            .iter()
            .map(|sample| (sample.bodies[body].position - sample.bodies[heaviest].position).norm());
        apart.sum()
    };
    let distances: Vec<_> = (0..bodies.len()).map(distance).collect();
    let by_distance = |a: &usize, b: &usize| distances[*a].total_cmp(&distances[*b]);
    let others = || (0..bodies.len()).filter(|body| *body != heaviest);
    let ends = [others().min_by(by_distance), others().max_by(by_distance)];
    std::iter::once(heaviest)
        .chain(ends.into_iter().flatten())
        .collect()
}

/// The body of the greatest mass; the first of several.
pub(super) fn heaviest(flight: &FlightData) -> usize {
    let bodies = flight.scene.bodies.iter().enumerate();
    let by_mass = bodies.map(|(body, named)| (body, named.body.mass()));
    by_mass
        .reduce(|best, next| if next.1 > best.1 { next } else { best })
        .map_or(0, |(body, _)| body)
}
