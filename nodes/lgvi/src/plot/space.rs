//! The flight in space: where the bodies went and how they were turned, with the orbits they came from and go to, and
//! the corridors and ellipsoids that they must stay in or out of.

use lgvi_control::constraint::FramePose;
use nalgebra::Vector3;
use plotters::style::RGBColor;

use super::bodies::Shape;
use super::cage::Cage;
use super::canvas::{Canvas, Stroke};
use super::chart::Rectangle;
use super::data::FlightData;
use super::legend::{Entry, Mark, draw_legend, legend_height};
use super::maneuver::Orbits;
use super::marks::{Item, boundary, force, initial_orbit, target_orbit};
use super::scenery::{corridors, ellipsoids};
use super::subject::named;
use super::thin::even;
use super::view::Camera;
use super::{limits, style};

/// Instants at which bodies are shown.
const INSTANTS: usize = 25;

/// Points of all trajectories together.
const POINTS: usize = 12_000;

/// Bodies that would be smaller than the first are enlarged to the second (px).
const SMALLEST: [f64; 2] = [10.0, 15.0];

/// Length of a body's axes outside of it, of the picture's width.
pub(super) const AXES: f64 = 0.026;

/// Draws into `whole`, the legend on top.
pub(super) fn draw(canvas: &mut Canvas<'_>, whole: Rectangle, flight: &FlightData) {
    draw_from(canvas, whole, flight, FramePose::INERTIAL);
}

/// Draws a flight that is seen from a frame, whose last pose is `end` (m).
pub(super) fn draw_from(
    canvas: &mut Canvas<'_>,
    whole: Rectangle,
    flight: &FlightData,
    end: FramePose,
) {
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
    let corridors = corridors(flight, &end);
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
    let ellipsoids: Vec<_> = ellipsoids(flight, &end).collect();
    for ellipsoid in &ellipsoids {
        held.extend(ellipsoid.corners());
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
    picture.draw_limits(canvas, &corridors, &ellipsoids);
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

/// The picture while it is put together.
pub(super) struct Picture<'a> {
    pub(super) flight: &'a FlightData,
    pub(super) shapes: Vec<Shape>,
    /// Bodies with a color and a name.
    pub(super) named: Vec<usize>,
    /// By how much each body is drawn larger than it is.
    pub(super) enlarged: Vec<f64>,
    pub(super) cage: Cage,
    /// With their nearness.
    pub(super) items: Vec<(f64, Item)>,
}

impl Picture<'_> {
    pub(super) fn color(&self, body: usize) -> RGBColor {
        let number = self.named.iter().position(|named| *named == body);
        number.map_or(style::OTHERS, |number| style::BODIES[number])
    }

    fn enlarge(&mut self) {
        let [smallest, shown] = SMALLEST;
        let factor = |body: usize| {
            let reach = self.shapes[body].reach() * self.cage.scale;
            let small = reach > 0.0 && reach < smallest && self.is_shown(body);
            if small { shown / reach } else { 1.0 }
        };
        self.enlarged = (0..self.shapes.len()).map(factor).collect();
    }

    /// Whether a body is drawn beside its trajectory: of a crowd only the first one named.
    pub(super) fn is_shown(&self, body: usize) -> bool {
        self.named.len() == self.shapes.len() || self.named.first() == Some(&body)
    }

    pub(super) fn add(&mut self, at: &Vector3<f64>, item: impl FnOnce(&Cage) -> Item) {
        let item = item(&self.cage);
        self.items.push((self.cage.nearness(at), item));
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
        let kept_out = Stroke::new(style::LIMIT, 1.5);
        for (kind, name, stroke) in [
            ("corridor", "corridor", boundary()),
            ("keep_in_sphere", "keep-in sphere", boundary()),
            ("keep_out_sphere", "keep-out sphere", kept_out),
            ("keep_out_ellipsoid", "keep-out ellipsoid", kept_out),
        ] {
            if let Some(label) = limits::label(self.flight, kind, name) {
                add(Mark::Line(stroke), label);
            }
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
