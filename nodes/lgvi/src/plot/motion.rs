//! The bodies of a flight in space: trajectories, how they were turned, and the forces on them.

use nalgebra::Vector3;
use plotters::style::RGBColor;

use super::canvas::{Place, Stroke};
use super::chart::Rectangle;
use super::data::Sample;
use super::marks::{Item, darker};
use super::space::{AXES, Picture};
use super::style;

/// Strokes of a trajectory that are ordered by depth among each other.
const PIECES: usize = 320;

/// Length of the strongest force, of the picture's width.
const STRONGEST: f64 = 0.12;

/// Area that a trajectory is spread over: of the box round it, were it square (px²).
fn covered(places: &[Place]) -> f64 {
    let sides = [0, 1].map(|i| {
        let values = || places.iter().map(|place| place[i]);
        let low = values().fold(f64::INFINITY, f64::min);
        values().fold(f64::NEG_INFINITY, f64::max) - low
    });
    0.5 * sides.iter().map(|side| side * side).sum::<f64>()
}

impl Picture<'_> {
    /// The trajectory in pieces, farther ones paler, those of bodies without a name thinner.
    pub(super) fn add_trajectory(
        &mut self,
        trajectory: &[Vector3<f64>],
        color: RGBColor,
        body: usize,
    ) {
        let width = if self.named.contains(&body) { 2.6 } else { 1.0 };
        let places: Vec<_> = trajectory
            .iter()
            .map(|point| self.cage.place(point))
            .collect();
        let width = Stroke::new(color, width)
            .within(&[&places], covered(&places))
            .width;
        let length = trajectory.len().div_ceil(PIECES).max(2);
        for start in (0..trajectory.len().saturating_sub(1)).step_by(length) {
            // One point more than its own, to meet the next.
            let end = (start + length + 1).min(trajectory.len());
            let piece = &trajectory[start..end];
            let middle = piece[piece.len() / 2];
            let pale = 0.35 * (1.0 - self.cage.nearness(&middle)).clamp(0.0, 1.0);
            self.add(&middle, |cage| {
                let places = piece.iter().map(|point| cage.place(point)).collect();
                Item::Piece(places, Stroke::new(style::faded(color, pale), width))
            });
        }
    }

    /// Bodies, forces, start and end of those with a name. A body is drawn at its end, and before where it is clear of
    /// what is drawn of it already.
    pub(super) fn add_instants(
        &mut self,
        instants: &[usize],
        trajectories: &[Vec<Vector3<f64>>],
        space: Rectangle,
    ) {
        let flight = self.flight;
        let strongest = self.strongest(instants);
        let width = space.to[0] - space.from[0];
        for body in self.named.clone() {
            let radius = self.shapes[body].radius() * self.enlarged[body];
            let clear = 1.2 * radius.max(AXES * width / self.cage.scale);
            let mut drawn: Vec<Vector3<f64>> = Vec::new();
            for (number, k) in instants.iter().enumerate().rev() {
                let sample = &flight.samples[*k];
                let late = number as f64 / (instants.len() - 1).max(1) as f64;
                let center = self.shapes[body].center_at(&sample.bodies[body]);
                if self.is_shown(body) && drawn.iter().all(|other| (center - other).norm() > clear)
                {
                    drawn.push(center);
                    let color = style::faded(self.color(body), 0.5 * (1.0 - late));
                    self.add_body(body, *k, color, width);
                }
                self.add_force(body, sample, strongest, width);
            }
            let color = self.color(body);
            let trajectory = &trajectories[body];
            let ends = [trajectory[0], trajectory[trajectory.len() - 1]];
            let [first, last] = ends.map(|end| self.cage.place(&end));
            if (first[0] - last[0]).abs() + (first[1] - last[1]).abs() < 1.0
                && self.shapes.len() > 1
            {
                continue;
            }
            // Nothing hides them.
            self.items.push((2.0, Item::Start(first, color)));
            self.items.push((2.0, Item::End(last, color)));
        }
    }

    fn add_force(&mut self, body: usize, sample: &Sample, strongest: f64, width: f64) {
        let load = self.flight.tracks[body].at(sample.step);
        let force = self.flight.scene.units.load_to_si(&load).force;
        if strongest > 0.0 && force != Vector3::zeros() {
            let from = sample.bodies[body].position;
            let length = STRONGEST * width / (self.cage.scale * strongest);
            let tip = from + length * force;
            self.add(&(from + 0.5 * length * force), |cage| {
                Item::Force(cage.place(&from), cage.place(&tip))
            });
        }
    }

    /// The strongest force at the instants (N).
    fn strongest(&self, instants: &[usize]) -> f64 {
        let flight = self.flight;
        let forces = instants.iter().flat_map(|k| {
            let step = flight.samples[*k].step;
            flight
                .tracks
                .iter()
                .map(move |track| track.at(step).force.norm())
        });
        forces.fold(0.0, f64::max) * flight.scene.units.force()
    }

    fn add_body(&mut self, body: usize, k: usize, color: RGBColor, width: f64) {
        let pose = self.flight.samples[k].bodies[body];
        let center = self.shapes[body].center_at(&pose);
        if center != pose.position {
            let rod = [pose.position, center];
            self.add(&(0.5 * (center + pose.position)), |cage| {
                Item::Bar(rod.map(|end| cage.place(&end)).into(), color)
            });
        }
        let points = self.shapes[body].points_at(&pose, self.enlarged[body]);
        let reach = self.shapes[body].reach() * self.enlarged[body];
        let radius = (0.16 * reach * self.cage.scale).clamp(2.4, 5.0);
        for (point, share) in &points {
            let middle = 0.5 * (point + pose.position);
            self.add(&middle, |cage| {
                Item::Bar(
                    [pose.position, *point].map(|end| cage.place(&end)).into(),
                    color,
                )
            });
            let radius = radius * libm::cbrt(2.0 * share);
            self.add(point, |cage| Item::Ball(cage.place(point), radius, color));
        }
        self.add_surface(body, k, color);
        if self.shapes[body].has_axes() {
            for (axis, color) in style::COMPONENTS.into_iter().enumerate() {
                let inside = self.shapes[body].support(&Vector3::ith(axis, 1.0));
                let length = inside * self.enlarged[body] + AXES * width / self.cage.scale;
                let tip = center + length * pose.attitude.column(axis);
                let middle = 0.5 * (tip + center);
                self.add(&middle, |cage| {
                    Item::Axis(cage.place(&center), cage.place(&tip), color)
                });
            }
        }
    }

    /// The faces of a body that are seen, lit from the viewer.
    fn add_surface(&mut self, body: usize, k: usize, color: RGBColor) {
        let pose = &self.flight.samples[k].bodies[body];
        let vertices = self.shapes[body].vertices_at(pose, self.enlarged[body]);
        for face in self.shapes[body].faces.clone() {
            let [a, b, c] = face.map(|vertex| vertices[vertex]);
            let lit = self.cage.lit(&(b - a).cross(&(c - a)));
            if lit > 0.0 {
                let color = style::faded(darker(color), 0.15 + 0.6 * lit);
                self.add(&((a + b + c) / 3.0), |cage| {
                    Item::Face([a, b, c].map(|corner| cage.place(&corner)), color)
                });
            }
        }
    }
}
