//! The flight in space: where the bodies went and how they were turned, with the orbits they came from and go to.

use nalgebra::Vector3;
use plotters::style::{Color, RGBColor};

use super::bodies::Shape;
use super::cage::Cage;
use super::canvas::{Canvas, Stroke};
use super::chart::Rectangle;
use super::data::FlightData;
use super::legend::{Entry, Mark, draw_legend, legend_height};
use super::maneuver::Orbits;
use super::marks::{Item, force, initial_orbit, target_orbit};
use super::orbit::Orbit;
use super::style;
use super::thin::even;
use super::view::Camera;

/// Instants at which bodies are shown, the most wanted number first.
const MORE_OR_LESS: [usize; 7] = [25, 24, 26, 23, 27, 22, 28];

/// Points of all trajectories together.
const POINTS: usize = 12_000;

/// Strokes of a trajectory that are ordered by depth among each other.
const PIECES: usize = 320;

/// Bodies that would be smaller than the first are enlarged to the second (px).
const SMALLEST: [f64; 2] = [10.0, 15.0];

/// Length of a body's axes and of the strongest force, of the picture's width.
const AXES: f64 = 0.035;
const STRONGEST: f64 = 0.12;

/// Draws into `whole`, the legend on top.
pub(super) fn draw(canvas: &mut Canvas<'_>, whole: Rectangle, flight: &FlightData) {
    let scene = &flight.scene;
    let shapes: Vec<_> = scene
        .bodies
        .iter()
        .map(|named| Shape::of(&named.body, scene.units.length))
        .collect();
    let each = even(flight.samples.len(), (POINTS / shapes.len().max(1)).max(50));
    let trajectories: Vec<Vec<_>> = (0..shapes.len())
        .map(|body| {
            each.iter()
                .map(|k| flight.samples[*k].bodies[body].position)
                .collect()
        })
        .collect();
    let instants = instants(flight);
    let orbits = Orbits::of(flight);
    let curves: Vec<_> = orbits
        .iter()
        .flat_map(|orbits| {
            let all = std::iter::once(&orbits.initial).chain(&orbits.target);
            all.map(|orbit| orbits.points(orbit))
        })
        .collect();

    let camera = Camera::facing(&curves, &trajectories);
    let mut held: Vec<_> = trajectories
        .iter()
        .chain(&curves)
        .flatten()
        .copied()
        .collect();
    for k in &instants {
        for (shape, pose) in shapes.iter().zip(&flight.samples[*k].bodies) {
            held.extend(shape.at(pose, 1.0).into_iter().map(|(point, _)| point));
        }
    }
    let center = scene
        .gravity
        .central
        .as_ref()
        .map(|central| central.position * scene.units.length);
    held.extend(center);

    let mut picture = Picture {
        flight,
        shapes,
        enlarged: 1.0,
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
    for (body, trajectory) in trajectories.iter().enumerate() {
        picture.add_trajectory(trajectory, picture.color(body));
    }
    picture.add_instants(&instants, space);
    if let Some(center) = center {
        picture.add(&center, |cage| Item::Attractor(cage.place(&center)));
    }
    picture.draw_items(canvas);
    picture.cage.draw_numbers(canvas);
}

/// Indices of the instants at which bodies are shown: evenly in time, as many as put none on top of another when a
/// flight comes round again and again.
fn instants(flight: &FlightData) -> Vec<usize> {
    let closest = |instants: &[usize]| {
        let mut least = f64::INFINITY;
        for (number, k) in instants.iter().enumerate() {
            for other in &instants[..number] {
                let [a, b] = [k, other].map(|k| &flight.samples[*k].bodies);
                let between = a
                    .iter()
                    .zip(b)
                    .map(|(a, b)| (a.position - b.position).norm());
                least = between.fold(least, f64::min);
            }
        }
        least * instants.len() as f64
    };
    let choices = MORE_OR_LESS.map(|count| even(flight.samples.len(), count));
    let scored = choices
        .into_iter()
        .map(|instants| (closest(&instants), instants));
    let best = scored.reduce(|best, next| if next.0 > 1.5 * best.0 { next } else { best });
    best.map(|(_, instants)| instants).unwrap_or_default()
}

/// The picture while it is put together.
struct Picture<'a> {
    flight: &'a FlightData,
    shapes: Vec<Shape>,
    /// By how much bodies are drawn larger than they are.
    enlarged: f64,
    cage: Cage,
    /// With their nearness.
    items: Vec<(f64, Item)>,
}

impl Picture<'_> {
    fn color(&self, body: usize) -> RGBColor {
        style::BODIES[body % style::BODIES.len()]
    }

    fn enlarge(&mut self) {
        let reach = self.shapes.iter().map(Shape::reach).fold(0.0, f64::max) * self.cage.scale;
        let [smallest, shown] = SMALLEST;
        self.enlarged = if reach > 0.0 && reach < smallest {
            shown / reach
        } else {
            1.0
        };
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
            .chain(target.iter().map(|target| (target, style::GREEN)));
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

    /// The trajectory in pieces, farther ones paler.
    fn add_trajectory(&mut self, trajectory: &[Vector3<f64>], color: RGBColor) {
        let length = trajectory.len().div_ceil(PIECES).max(2);
        for start in (0..trajectory.len().saturating_sub(1)).step_by(length) {
            // One point more than its own, to meet the next.
            let end = (start + length + 1).min(trajectory.len());
            let piece = &trajectory[start..end];
            let middle = piece[piece.len() / 2];
            let pale = 0.35 * (1.0 - self.cage.nearness(&middle)).clamp(0.0, 1.0);
            self.add(&middle, |cage| {
                let places = piece.iter().map(|point| cage.place(point)).collect();
                Item::Piece(places, style::faded(color, pale))
            });
        }
    }

    /// Bodies, forces, start and end.
    fn add_instants(&mut self, instants: &[usize], space: Rectangle) {
        let flight = self.flight;
        let scene = &flight.scene;
        let strongest = self.strongest(instants);
        let width = space.to[0] - space.from[0];
        for (number, k) in instants.iter().enumerate() {
            let sample = &flight.samples[*k];
            let late = number as f64 / (instants.len() - 1).max(1) as f64;
            for (body, pose) in sample.bodies.iter().enumerate() {
                let color = style::faded(self.color(body), 0.5 * (1.0 - late));
                self.add_body(body, *k, color, width);
                let load = scene.units.load_to_si(&flight.tracks[body].at(sample.step));
                if strongest > 0.0 && load.force != Vector3::zeros() {
                    let length = STRONGEST * width / (self.cage.scale * strongest);
                    let tip = pose.position + length * load.force;
                    let middle = pose.position + 0.5 * length * load.force;
                    self.add(&middle, |cage| {
                        Item::Force(cage.place(&pose.position), cage.place(&tip))
                    });
                }
            }
        }
        for body in 0..self.shapes.len() {
            let color = self.color(body);
            let [first, last] =
                [flight.first(), flight.last()].map(|sample| sample.bodies[body].position);
            // Nothing hides them.
            self.items
                .push((2.0, Item::Start(self.cage.place(&first), color)));
            self.items
                .push((2.0, Item::End(self.cage.place(&last), color)));
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
        let points = self.shapes[body].at(&pose, self.enlarged);
        let radius =
            (0.16 * self.shapes[body].reach() * self.enlarged * self.cage.scale).clamp(2.4, 5.0);
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
        if points.is_empty() {
            let length = AXES * width / self.cage.scale;
            for (axis, color) in style::COMPONENTS.into_iter().enumerate() {
                let tip = pose.position + length * pose.attitude.column(axis);
                let middle = 0.5 * (tip + pose.position);
                self.add(&middle, |cage| {
                    Item::Axis(cage.place(&pose.position), cage.place(&tip), color)
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
        let mut add = |mark, text: String| entries.push(Entry { mark, text });
        for (body, named) in self.flight.scene.bodies.iter().enumerate() {
            add(
                Mark::Line(Stroke::new(self.color(body), 2.6)),
                named.name.clone(),
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
        if self.shapes.iter().any(|shape| !shape.has_points()) {
            for (name, color) in ["x", "y", "z"].into_iter().zip(style::COMPONENTS) {
                add(Mark::Line(Stroke::new(color, 2.0)), format!("body {name}"));
            }
        }
        if self.enlarged > 1.0 {
            add(
                Mark::None,
                format!("bodies drawn {} × larger", rounded(self.enlarged)),
            );
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
