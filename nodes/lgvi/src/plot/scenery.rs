//! What stays where it is beside the bodies of a flight: orbits, corridors, ellipsoids, frames.

use std::f64::consts::TAU;

use lgvi_control::constraint::{FramePose, Region};
use nalgebra::{Matrix3, Vector3};
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

/// Corners of an outline.
const CORNERS: u32 = 96;

/// Apex and rim of each corridor (m), seen from a frame, as far as the flight was from the apex.
pub(super) fn corridors(
    flight: &FlightData,
    from: &FramePose,
) -> Vec<(Vector3<f64>, Vec<Vector3<f64>>)> {
    let length = flight.scene.units.length;
    let body = turned(flight);
    let corridors = limits::regions(flight).filter_map(|region| {
        let Region::Corridor {
            apex,
            axis,
            half_angle,
        } = region
        else {
            return None;
        };
        let apex = from.seen(&(apex * length));
        let positions = flight.samples.iter();
        let distances = positions.map(|sample| (sample.bodies[body].position - apex).norm());
        let reach = distances.fold(0.0, f64::max);
        let axis = from.rotation.tr_mul(&axis);
        Some((apex, limits::rim(&apex, &axis, half_angle, reach)))
    });
    corridors.collect()
}

/// An ellipsoid or sphere (m) to keep out of, or in, seen from a frame, where it is at the end: `center + arms u` with `|u| = 1`.
pub(super) struct Ellipsoid {
    center: Vector3<f64>,
    arms: Matrix3<f64>,
    /// Whether to keep in.
    inner: bool,
}

pub(super) fn ellipsoids(flight: &FlightData, from: &FramePose) -> impl Iterator<Item = Ellipsoid> {
    let length = flight.scene.units.length;
    limits::regions(flight).filter_map(move |region| {
        let (center, arms, inner) = match region {
            Region::OutsideEllipsoid {
                center,
                semi_axes,
                axes,
            } => (center, axes * Matrix3::from_diagonal(&semi_axes), false),
            Region::InsideSphere { center, radius } => {
                (center, Matrix3::from_diagonal_element(radius), true)
            }
            _ => return None,
        };
        Some(Ellipsoid {
            center: from.seen(&(center * length)),
            arms: from.rotation.tr_mul(&(arms * length)),
            inner,
        })
    })
}

impl Ellipsoid {
    /// Two opposite corners of the box around it, along the axes.
    pub(super) fn corners(&self) -> [Vector3<f64>; 2] {
        let arm = Vector3::from_fn(|axis, _| self.arms.row(axis).norm());
        [self.center - arm, self.center + arm]
    }

    /// What is seen of it, from the direction at right angles to `across` and `up`: its points farthest along each direction in their
    /// plane.
    fn outline(&self, [across, up]: [Vector3<f64>; 2]) -> Vec<Vector3<f64>> {
        let farthest = |k: u32| {
            let (sin, cos) = libm::sincos(TAU * f64::from(k) / f64::from(CORNERS));
            let along = self.arms.tr_mul(&(cos * across + sin * up));
            self.center + self.arms * along.normalize()
        };
        (0..=CORNERS).map(farthest).collect()
    }
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

    /// Corridors and ellipsoids.
    pub(super) fn draw_limits(
        &self,
        canvas: &mut Canvas<'_>,
        corridors: &[(Vector3<f64>, Vec<Vector3<f64>>)],
        ellipsoids: &[Ellipsoid],
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
        for ellipsoid in ellipsoids {
            let outline = ellipsoid.outline(self.cage.camera.across());
            let places: Vec<_> = outline.iter().map(|point| self.cage.place(point)).collect();
            let color = if ellipsoid.inner {
                style::TARGET
            } else {
                style::LIMIT
            };
            canvas.area(&places, style::faded(color, 0.85).to_rgba());
            canvas.path(&places, Stroke::new(color, 1.5));
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of the ellipsoid in which the line of sight is tangent to it.
    #[test]
    fn an_outline_is_where_the_ellipsoid_turns_away() {
        let [across, up] = [Vector3::new(0.6, 0.8, 0.0), Vector3::new(0.0, 0.0, 1.0)];
        let axes = lgvi_lie::exp(&Vector3::new(0.3, -0.5, 0.7));
        let arms = axes * Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 5.0));
        let center = Vector3::new(3.0, -1.0, 2.0);
        let outline = Ellipsoid {
            center,
            arms,
            inner: false,
        }
        .outline([across, up]);
        let towards = across.cross(&up);
        for point in &outline {
            let unit = arms.try_inverse().unwrap() * (point - center);
            assert!((unit.norm() - 1.0).abs() < 1e-14, "{unit}");
            let normal = arms.transpose().try_inverse().unwrap() * unit;
            assert!(normal.dot(&towards).abs() < 1e-14, "{normal}");
        }
        assert!(
            (outline[0] - outline[outline.len() - 1]).norm() < 1e-14,
            "closed"
        );
        let [low, high] = Ellipsoid {
            center,
            arms,
            inner: false,
        }
        .corners();
        assert!(outline.iter().all(|point| *point >= low && *point <= high));
        let widest = (high - low).dot(&up);
        let heights = outline.iter().map(|point| (point - center).dot(&up));
        assert!((2.0 * heights.fold(0.0, f64::max) - widest).abs() < 1e-12);
    }
}
