//! What stays where it is beside the bodies of a flight: orbits, corridors, spheres, frames.

use lgvi_control::constraint::{Corridor, FramePose, KeepInSphere, KeepOutSphere};
use nalgebra::Vector3;
use plotters::style::Color;

use super::canvas::{Anchor, Canvas, Font, Stroke};
use super::chart::Rectangle;
use super::data::FlightData;
use super::maneuver::Orbits;
use super::marks::{boundary, initial_orbit, target_orbit};
use super::orbit::Orbit;
use super::series::turned;
use super::space::{AXES, Picture};
use super::{limits, style};

/// Lines from a corridor's apex to its rim.
const SIDES: usize = 12;

/// Apex and rim of each corridor (m), seen from a frame, as far as the flight was from the apex.
pub(super) fn corridors(
    flight: &FlightData,
    from: &FramePose,
) -> Vec<(Vector3<f64>, Vec<Vector3<f64>>)> {
    let length = flight.scene.units.length;
    let body = turned(flight);
    let corridor = limits::all::<Corridor>(flight).map(|framed| {
        let (frame, corridor) = (framed.last_pose(), framed.constraint);
        let apex = from.seen(&(frame.point(corridor.apex()) * length));
        let positions = flight.samples.iter();
        let distances = positions.map(|sample| (sample.bodies[body].position - apex).norm());
        let reach = distances.fold(0.0, f64::max);
        let axis = from.rotation.tr_mul(&(frame.rotation * corridor.axis()));
        let rim = limits::rim(&apex, &axis, corridor.half_angle(), reach);
        (apex, rim)
    });
    corridor.collect()
}

/// A sphere (m) to keep out of, or in, seen from a frame, where it is at the end.
pub(super) struct Sphere {
    pub(super) center: Vector3<f64>,
    pub(super) radius: f64,
    /// True if it is to be kept in.
    inner: bool,
}

pub(super) fn spheres<'f>(
    flight: &'f FlightData,
    from: &'f FramePose,
) -> impl Iterator<Item = Sphere> + use<'f> {
    let length = flight.scene.units.length;
    let sphere = move |pose: FramePose, center, radius, inner| Sphere {
        center: from.seen(&(pose.point(center) * length)),
        radius: radius * length,
        inner,
    };
    let outer = limits::all::<KeepOutSphere>(flight).map(move |framed| {
        let own = framed.constraint;
        sphere(framed.last_pose(), own.center(), own.radius(), false)
    });
    let inner = limits::all::<KeepInSphere>(flight).map(move |framed| {
        let own = framed.constraint;
        sphere(framed.last_pose(), own.center(), own.radius(), true)
    });
    outer.chain(inner)
}

impl Picture<'_> {
    /// Planes and outlines of the orbits of a maneuver.
    pub(super) fn draw_orbits(&self, canvas: &mut Canvas<'_>, orbits: &Orbits) {
        let Orbits {
            initial, target, ..
        } = orbits;
        let colored = std::iter::once((initial, style::SOFT_INK))
            .chain(target.iter().map(|target| (target, style::TARGET)));
        let outline = |orbit: &Orbit| -> Vec<_> {
            orbits
                .points(orbit)
                .iter()
                .map(|point| self.cage.place(point))
                .collect()
        };
        for (orbit, color) in colored {
            if orbits.close(orbit) {
                canvas.area(&outline(orbit), color.mix(0.08));
            }
        }
        canvas.path(&outline(initial), initial_orbit());
        if let Some(target) = target {
            canvas.dashed(&outline(target), target_orbit(), [7.0, 4.0]);
        }
    }

    /// Corridors and spheres.
    pub(super) fn draw_limits(
        &self,
        canvas: &mut Canvas<'_>,
        corridors: &[(Vector3<f64>, Vec<Vector3<f64>>)],
        spheres: &[Sphere],
    ) {
        for (apex, rim) in corridors {
            let places: Vec<_> = rim.iter().map(|point| self.cage.place(point)).collect();
            canvas.area(&places, style::TARGET.mix(0.08));
            canvas.path(&places, boundary());
            let side = Stroke {
                color: style::TARGET.mix(0.35),
                width: 1.0,
            };
            for place in places.iter().step_by(places.len() / SIDES) {
                canvas.path(&[self.cage.place(apex), *place], side);
            }
        }
        for sphere in spheres {
            let center = self.cage.place(&sphere.center);
            let radius = sphere.radius * self.cage.scale;
            let color = if sphere.inner {
                style::TARGET
            } else {
                style::LIMIT
            };
            let ring = Stroke::new(color, 1.5);
            canvas.ringed(center, radius, style::faded(color, 0.85), ring);
        }
    }

    /// The scene's fixed frames, by their axes and names.
    pub(super) fn draw_frames(&self, canvas: &mut Canvas<'_>, space: Rectangle) {
        let reach = AXES * (space.to[0] - space.from[0]) / self.cage.scale;
        for frame in limits::fixed_frames(self.flight) {
            let origin = frame.position * self.flight.scene.units.length;
            let place = self.cage.place(&origin);
            for (axis, color) in style::COMPONENTS.into_iter().enumerate() {
                let tip = origin + reach * frame.attitude.column(axis);
                canvas.path(&[place, self.cage.place(&tip)], Stroke::new(color, 2.4));
            }
            let font = Font {
                size: style::LABEL,
                color: style::INK,
                anchor: Anchor::Middle,
            };
            canvas.text(&frame.name, [place[0], place[1] + 18.0], font);
        }
    }
}
