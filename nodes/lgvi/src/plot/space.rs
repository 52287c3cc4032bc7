//! The flight in space: where the bodies went and how they were turned, with the orbits they came from and go to, and
//! the corridors and spheres that they must stay in or out of.

use nalgebra::Vector3;
use plotters::style::{Color, RGBColor};

use super::bodies::Shape;
use super::cage::Cage;
use super::canvas::{Anchor, Canvas, Font, Stroke};
use super::chart::Rectangle;
use super::data::{FlightData, Sample};
use super::legend::{Entry, Mark, draw_legend, legend_height};
use super::maneuver::Orbits;
use super::marks::{Item, boundary, darker, force, initial_orbit, target_orbit};
use super::orbit::Orbit;
use super::subject::named;
use super::thin::even;
use super::view::Camera;
use super::{limits, style};

/// Instants at which bodies are shown.
const INSTANTS: usize = 25;

/// Points of all trajectories together.
const POINTS: usize = 12_000;

/// Strokes of a trajectory that are ordered by depth among each other.
const PIECES: usize = 320;

/// Bodies that would be smaller than the first are enlarged to the second (px).
const SMALLEST: [f64; 2] = [10.0, 15.0];

/// Length of a body's axes and of the strongest force, of the picture's width.
const AXES: f64 = 0.026;
const STRONGEST: f64 = 0.12;

/// Lines from a corridor's apex to its rim.
const SIDES: usize = 12;

/// Draws into `whole`, the legend on top.
pub(super) fn draw(canvas: &mut Canvas<'_>, whole: Rectangle, flight: &FlightData) {
    let scene = &flight.scene;
    let length = scene.units.length;
    let shapes: Vec<_> = (scene.bodies.iter())
        .map(|named| Shape::of(named, length))
        .collect();
    let each = even(flight.samples.len(), (POINTS / shapes.len().max(1)).max(50));
    let trajectories: Vec<Vec<_>> = (0..shapes.len())
        .map(|body| {
            let poses = each.iter().map(|k| &flight.samples[*k].bodies[body]);
            poses.map(|pose| shapes[body].center_at(pose)).collect()
        })
        .collect();
    let orbits = Orbits::of(flight);
    let curves: Vec<_> = orbits
        .iter()
        .flat_map(|orbits| {
            let all = std::iter::once(&orbits.initial).chain(&orbits.target);
            all.map(|orbit| orbits.points(orbit))
        })
        .collect();

    let hanging = scene.gravity.uniform.is_some_and(|g| g.z > 0.0);
    let camera = Camera::facing(&curves, &trajectories, hanging);
    let named = named(flight);
    let corridors = corridors(flight);
    let mut held: Vec<_> = trajectories
        .iter()
        .chain(&curves)
        .chain(corridors.iter().map(|(_, rim)| rim))
        .flatten()
        .copied()
        .collect();
    let instants = even(flight.samples.len(), INSTANTS);
    for body in &named {
        let shape = &shapes[*body];
        for k in &instants {
            let pose = &flight.samples[*k].bodies[*body];
            held.push(pose.position);
            held.extend(shape.points_at(pose, 1.0).iter().map(|(point, _)| point));
            held.extend(shape.vertices_at(pose, 1.0));
        }
    }
    for sphere in limits::spheres(flight) {
        let arm = Vector3::repeat(sphere.radius());
        held.extend([sphere.center() - arm, sphere.center() + arm].map(|corner| corner * length));
    }
    let center = scene.gravity.central.as_ref();
    let center = center.map(|central| central.position * length);
    held.extend(center);
    held.extend(limits::fixed_frames(flight).map(|frame| frame.position * length));

    let mut picture = Picture {
        flight,
        shapes,
        named,
        enlarged: Vec::new(),
        cage: Cage::around(&held, camera, whole),
        items: Vec::new(),
    };
    picture.enlarge();
    // The legend's height does not depend on the room that it leaves, though the factor in it does.
    let height = legend_height(&picture.legend(orbits.as_ref()), whole);
    let space = Rectangle {
        from: [whole.from[0], whole.from[1] + height],
        to: whole.to,
    };
    picture.cage = Cage::around(&held, camera, space);
    picture.enlarge();
    draw_legend(canvas, &picture.legend(orbits.as_ref()), whole);

    picture.cage.draw_walls(canvas);
    if let Some(orbits) = &orbits {
        picture.draw_orbits(canvas, orbits);
    }
    picture.draw_limits(canvas, &corridors);
    for (body, trajectory) in trajectories.iter().enumerate() {
        picture.add_trajectory(trajectory, picture.color(body), body);
    }
    picture.add_instants(&instants, &trajectories, space);
    if let Some(central) = &scene.gravity.central {
        let center = central.position * length;
        picture.add(&center, |cage| {
            Item::Attractor(cage.place(&center), central.radius * length * cage.scale)
        });
    }
    picture.draw_items(canvas);
    picture.draw_frames(canvas, space);
    picture.cage.draw_numbers(canvas);
}

/// Apex and rim of each corridor (m), as far as the flight was from the apex.
fn corridors(flight: &FlightData) -> Vec<(Vector3<f64>, Vec<Vector3<f64>>)> {
    let length = flight.scene.units.length;
    let body = super::series::turned(flight);
    let corridor = limits::corridors(flight).map(|corridor| {
        let apex = corridor.apex() * length;
        let positions = flight.samples.iter();
        let distances = positions.map(|sample| (sample.bodies[body].position - apex).norm());
        let reach = distances.fold(0.0, f64::max);
        let rim = limits::rim(&apex, &corridor.axis(), corridor.half_angle(), reach);
        (apex, rim)
    });
    corridor.collect()
}

/// The picture while it is put together.
struct Picture<'a> {
    flight: &'a FlightData,
    shapes: Vec<Shape>,
    /// Bodies with a color and a name.
    named: Vec<usize>,
    /// By how much each body is drawn larger than it is.
    enlarged: Vec<f64>,
    cage: Cage,
    /// With their nearness.
    items: Vec<(f64, Item)>,
}

impl Picture<'_> {
    fn color(&self, body: usize) -> RGBColor {
        let number = self.named.iter().position(|named| *named == body);
        number.map_or(style::OTHERS, |number| style::BODIES[number])
    }

    fn enlarge(&mut self) {
        let [smallest, shown] = SMALLEST;
        let factor = |shape: &Shape| {
            let reach = shape.reach() * self.cage.scale;
            let small = reach > 0.0 && reach < smallest && !self.is_crowd();
            if small { shown / reach } else { 1.0 }
        };
        self.enlarged = self.shapes.iter().map(factor).collect();
    }

    /// Whether there are more bodies than have a name: those too small to be seen are not drawn then.
    fn is_crowd(&self) -> bool {
        self.named.len() < self.shapes.len()
    }

    fn add(&mut self, at: &Vector3<f64>, item: impl FnOnce(&Cage) -> Item) {
        let item = item(&self.cage);
        self.items.push((self.cage.nearness(at), item));
    }

    /// Planes and outlines of the orbits of a maneuver.
    fn draw_orbits(&self, canvas: &mut Canvas<'_>, orbits: &Orbits) {
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
    fn draw_limits(
        &self,
        canvas: &mut Canvas<'_>,
        corridors: &[(Vector3<f64>, Vec<Vector3<f64>>)],
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
        let length = self.flight.scene.units.length;
        for sphere in limits::spheres(self.flight) {
            let center = self.cage.place(&(sphere.center() * length));
            let radius = sphere.radius() * length * self.cage.scale;
            canvas.ringed(
                center,
                radius,
                style::faded(style::LIMIT, 0.85),
                Stroke::new(style::LIMIT, 1.5),
            );
        }
    }

    /// The scene's fixed frames, by their axes and names.
    fn draw_frames(&self, canvas: &mut Canvas<'_>, space: Rectangle) {
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

    /// The trajectory in pieces, farther ones paler, those of bodies without a name thinner.
    fn add_trajectory(&mut self, trajectory: &[Vector3<f64>], color: RGBColor, body: usize) {
        let width = if self.named.contains(&body) { 2.6 } else { 1.0 };
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
    fn add_instants(
        &mut self,
        instants: &[usize],
        trajectories: &[Vec<Vector3<f64>>],
        space: Rectangle,
    ) {
        let flight = self.flight;
        let strongest = self.strongest(instants);
        let width = space.to[0] - space.from[0];
        for body in self.named.clone() {
            let drawn_reach = self.shapes[body].reach() * self.enlarged[body];
            let shown = !self.is_crowd() || drawn_reach * self.cage.scale > SMALLEST[0];
            let clear = 1.2 * drawn_reach.max(AXES * width / self.cage.scale);
            let mut drawn: Vec<Vector3<f64>> = Vec::new();
            for (number, k) in instants.iter().enumerate().rev() {
                let sample = &flight.samples[*k];
                let late = number as f64 / (instants.len() - 1).max(1) as f64;
                let center = self.shapes[body].center_at(&sample.bodies[body]);
                if shown && drawn.iter().all(|other| (center - other).norm() > clear) {
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

    /// Draws what was added, the nearest last.
    fn draw_items(&mut self, canvas: &mut Canvas<'_>) {
        self.items.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, item) in self.items.drain(..) {
            item.draw(canvas);
        }
    }

    fn legend(&self, orbits: Option<&Orbits>) -> Vec<Entry> {
        let mut entries = Vec::new();
        let mut add = |mark, text: String| entries.push(Entry::new(mark, text));
        for body in &self.named {
            let line = Stroke::new(self.color(*body), 2.6);
            add(
                Mark::Line(line),
                self.flight.scene.bodies[*body].name.clone(),
            );
        }
        let others = self.shapes.len() - self.named.len();
        if others > 0 {
            let line = Stroke::new(style::OTHERS, 1.4);
            add(Mark::Line(line), format!("{others} other bodies"));
        }
        if limits::corridors(self.flight).next().is_some() {
            add(Mark::Line(boundary()), "corridor".into());
        }
        if limits::spheres(self.flight).next().is_some() {
            add(
                Mark::Line(Stroke::new(style::LIMIT, 1.5)),
                "keep-out sphere".into(),
            );
        }
        if orbits.is_some() {
            add(Mark::Line(initial_orbit()), "initial orbit".into());
        }
        if let Some((orbits, target)) =
            orbits.and_then(|orbits| Some((orbits, orbits.target.as_ref()?)))
        {
            let turned = orbits.plane_change(target);
            let text = if turned >= 0.05 {
                format!("target orbit, plane turned by {turned:.1}°")
            } else {
                "target orbit".into()
            };
            add(Mark::Dashes(target_orbit()), text);
        }
        if !self.flight.controlled().is_empty() {
            add(Mark::Arrow(force()), "control force".into());
        }
        let color = if self.shapes.len() == 1 {
            self.color(0)
        } else {
            style::SOFT_INK
        };
        add(Mark::Start(color), "start".into());
        add(Mark::End(color), "end".into());
        if self.flight.scene.gravity.central.is_some() {
            add(Mark::Attractor, "attractor".into());
        }
        if self.named.iter().any(|body| self.shapes[*body].has_axes()) {
            for (name, color) in ["x", "y", "z"].into_iter().zip(style::COMPONENTS) {
                add(Mark::Line(Stroke::new(color, 2.0)), format!("body {name}"));
            }
        }
        for body in &self.named {
            let factor = self.enlarged[*body];
            if factor > 1.0 {
                let name = &self.flight.scene.bodies[*body].name;
                add(
                    Mark::None,
                    format!("{name} drawn {} × larger", rounded(factor)),
                );
            }
        }
        entries
    }
}

/// Two digits of a factor.
fn rounded(factor: f64) -> String {
    if factor < 10.0 {
        return format!("{factor:.1}");
    }
    let power = libm::exp10(libm::floor(libm::log10(factor)) - 1.0);
    format!("{:.0}", (factor / power).round() * power)
}
