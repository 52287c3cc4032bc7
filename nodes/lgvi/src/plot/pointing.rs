//! A body that turns where it is: where its axes point, on the sphere of directions in the inertial frame, with the cones
//! that they must stay out of or in.

use lgvi_control::constraint::Region;
use nalgebra::Vector3;

use super::canvas::{Canvas, Stroke};
use super::chart::Rectangle;
use super::data::FlightData;
use super::globe::{self, Content};
use super::legend::{Entry, Mark};
use super::marks::{boundary, end, start};
use super::series::turned;
use super::thin::even;
use super::view::Camera;
use super::{limits, style};

/// Points of a path.
const POINTS: usize = 3000;

/// Draws into `space`.
pub(super) fn draw(canvas: &mut Canvas<'_>, space: Rectangle, flight: &FlightData) {
    let body = turned(flight);
    let path = |axis: &Vector3<f64>| -> Vec<_> {
        even(flight.samples.len(), POINTS)
            .into_iter()
            .map(|k| flight.samples[k].bodies[body].attitude * axis)
            .collect()
    };
    let mut legend = Vec::new();
    let mut curves = Vec::new();
    let mut ends = Vec::new();
    let cone = |region| match region {
        Region::OutsideCone {
            axis,
            direction,
            half_angle,
        } => Some((axis, direction, half_angle)),
        _ => None,
    };
    let cones: Vec<_> = limits::regions(flight).filter_map(cone).collect();
    let kept_out = |i| cones.iter().any(|(axis, ..)| *axis == Vector3::ith(i, 1.0));
    for (i, color) in style::COMPONENTS.into_iter().enumerate() {
        if kept_out(i) {
            continue;
        }
        let stroke = Stroke::new(color, 1.8);
        let path = path(&Vector3::ith(i, 1.0));
        ends.push((path[0], path[path.len() - 1], color));
        curves.push((path, stroke));
        legend.push(Entry::new(
            Mark::Line(stroke),
            ["body x", "body y", "body z"][i],
        ));
    }
    let rim = Stroke::new(style::LIMIT, 2.0);
    let kept = Stroke::new(style::BODIES[0], 4.0);
    let mut caps = Vec::new();
    let mut seen: Vector3<f64> = ends.iter().map(|(first, last, _)| first + last).sum();
    for (axis, direction, half_angle) in &cones {
        seen = *direction;
        let edge = limits::rim(&Vector3::zeros(), direction, *half_angle, 1.0);
        caps.push(edge.clone());
        curves.push((edge, rim));
        let path = path(axis);
        let (first, last) = (path[0], path[path.len() - 1]);
        seen += first + last;
        ends.push((first, last, style::BODIES[0]));
        curves.push((path, kept));
    }
    if !caps.is_empty() {
        let names = ["body x, kept out", "body y, kept out", "body z, kept out"];
        let name = (0..3)
            .find(|i| kept_out(*i))
            .map_or("axis kept out", |i| names[i]);
        legend.insert(0, Entry::new(Mark::Line(kept), name));
    }
    if let Some(label) = limits::label(flight, "keep_out_cone", "keep-out cone") {
        legend.push(Entry::new(Mark::Line(rim), label));
    }
    curves.extend(sights(flight).map(|edge| (edge, boundary())));
    if let Some(label) = limits::label(flight, "line_of_sight", "line of sight") {
        legend.push(Entry::new(Mark::Line(boundary()), label));
    }
    legend.push(Entry::new(Mark::Start(style::SOFT_INK), "start"));
    legend.push(Entry::new(Mark::End(style::SOFT_INK), "end"));
    let content = Content {
        legend,
        axes: [0, 1, 2].map(|i| Vector3::ith(i, 1.0)),
        names: ["x", "y", "z"],
        caps,
        curves,
    };
    // From where most is seen, a little from above.
    let aslant = Vector3::new(0.1, -0.1, 0.5);
    let from = seen.try_normalize(1e-6).unwrap_or_default() + aslant;
    let globe = globe::draw(canvas, space, Camera::from(&from.normalize()), &content);
    for (first, last, color) in ends {
        start(canvas, globe.place(&first), color);
        end(canvas, globe.place(&last), color);
    }
}

/// The rim of the directions that are near enough to that of each point in sight, at the end.
fn sights(flight: &FlightData) -> impl Iterator<Item = Vec<Vector3<f64>>> {
    let end = flight.last().bodies[turned(flight)].position;
    let length = flight.scene.units.length;
    limits::regions(flight).filter_map(move |region| {
        let Region::InSight {
            point, half_angle, ..
        } = region
        else {
            return None;
        };
        let direction = (point * length - end).try_normalize(0.0)?;
        Some(limits::rim(&Vector3::zeros(), &direction, half_angle, 1.0))
    })
}
