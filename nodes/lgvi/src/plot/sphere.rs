//! A free body: the path of its angular momentum on the sphere of constant `|Π|` in the body frame. It stays on one of
//! the curves of constant energy, the polhodes.

use lgvi_dynamics::Mobility;
use nalgebra::Vector3;
use plotters::style::RGBColor;

use super::canvas::{Anchor, Canvas, Font, Place, Stroke};
use super::chart::Rectangle;
use super::data::FlightData;
use super::legend::{Entry, Mark, draw_legend, legend_height};
use super::marks::{end, start};
use super::polhode::Polhodes;
use super::style;
use super::thin::even;
use super::view::Camera;

/// Points of the path.
const POINTS: usize = 6000;

/// Length of the axes, radius of the sphere 1.
const AXIS: f64 = 1.15;

/// Whether the flight is that of one body that turns freely and goes nowhere.
pub(super) fn is_free_body(flight: &FlightData) -> bool {
    let scene = &flight.scene;
    let [body] = scene.bodies.as_slice() else {
        return false;
    };
    let still = body.state.linear_momentum == Vector3::zeros();
    let free = scene.gravity.is_none() && *body.body.mobility() == Mobility::Free;
    let turns = flight
        .samples
        .iter()
        .all(|sample| sample.bodies[0].spin != Vector3::zeros());
    still && free && turns && flight.controlled().is_empty()
}

/// Where the unit sphere is in the picture.
struct Globe {
    camera: Camera,
    center: Place,
    radius: f64,
}

/// Draws into `space`.
pub(super) fn draw(canvas: &mut Canvas<'_>, space: Rectangle, flight: &FlightData) {
    let length = flight.first().bodies[0].spin.norm();
    let path: Vec<_> = even(flight.samples.len(), POINTS)
        .into_iter()
        .map(|k| flight.samples[k].bodies[0].spin / length)
        .collect();
    let polhodes = Polhodes::new(flight.scene.bodies[0].body.inertia().matrix());
    let separatrix = polhodes.separatrix();

    let flown = Stroke::new(style::BLUE, 3.0);
    let mut entries = vec![
        entry(Mark::Line(flown), "Π / |Π| as flown, body axes"),
        entry(Mark::Line(level()), "constant energy"),
    ];
    if !separatrix.is_empty() {
        entries.push(entry(Mark::Line(parting()), "separatrix"));
    }
    entries.push(entry(Mark::Start(style::BLUE), "start"));
    entries.push(entry(Mark::End(style::BLUE), "end"));
    draw_legend(canvas, &entries, space);

    let top = space.from[1] + legend_height(&entries, space);
    let half = [
        0.5 * (space.to[0] - space.from[0]),
        0.5 * (space.to[1] - top),
    ];
    let globe = Globe {
        camera: camera(&path, &polhodes.axes()),
        center: [space.from[0] + half[0], top + half[1]],
        radius: half[0].min(half[1]) / (AXIS + 0.05),
    };
    globe.draw_axes(canvas, &polhodes.axes(), false);
    globe.draw_ball(canvas);
    let mut curves: Vec<_> = polhodes
        .curves()
        .into_iter()
        .map(|curve| (curve, level()))
        .collect();
    curves.extend(separatrix.into_iter().map(|curve| (curve, parting())));
    for near in [false, true] {
        for (curve, stroke) in &curves {
            globe.draw_curve(canvas, curve, *stroke, near);
        }
        globe.draw_curve(canvas, &path, flown, near);
    }
    globe.draw_axes(canvas, &polhodes.axes(), true);
    let last = flight.last().bodies[0].spin / length;
    start(canvas, globe.place(&path[0]), style::BLUE);
    end(canvas, globe.place(&last), style::BLUE);
}

/// From near the axis that the path goes round, aslant so that the other axes are seen too.
fn camera(path: &[Vector3<f64>], axes: &[Vector3<f64>; 3]) -> Camera {
    let mean: Vector3<f64> = path.iter().sum();
    let along = [0, 1, 2].map(|i| mean.dot(&axes[i]));
    let weights = if along[0].abs() > along[2].abs() {
        [0.85, 0.5, 0.15]
    } else {
        [0.15, 0.5, 0.85]
    };
    let direction = (0..3)
        .map(|i| axes[i] * (weights[i] * 1_f64.copysign(along[i])))
        .sum();
    Camera::from(&direction)
}

fn entry(mark: Mark, text: &str) -> Entry {
    Entry {
        mark,
        text: text.into(),
    }
}

fn level() -> Stroke {
    Stroke::new(RGBColor(150, 150, 150), 1.1)
}

fn parting() -> Stroke {
    Stroke::new(style::ORANGE, 1.8)
}

impl Globe {
    fn place(&self, point: &Vector3<f64>) -> Place {
        let seen = self.radius * self.camera.project(point);
        [self.center[0] + seen.x, self.center[1] - seen.y]
    }

    /// The sphere itself, lighter towards its upper left.
    fn draw_ball(&self, canvas: &mut Canvas<'_>) {
        let shades = 24;
        for k in 0..shades {
            let part = f64::from(k) / f64::from(shades);
            let level = |edge: f64, center: f64| (edge + (center - edge) * part) as u8;
            let color = RGBColor(
                level(232.0, 253.0),
                level(236.0, 253.0),
                level(241.0, 254.0),
            );
            let shift = 0.3 * part * self.radius;
            let center = [self.center[0] - shift, self.center[1] - shift];
            canvas.disc(center, self.radius * (1.0 - part), color);
            if k == 0 {
                let edge = Stroke::new(style::FRAME, 1.2);
                canvas.ringed(self.center, self.radius, color, edge);
            }
        }
    }

    /// The parts of a curve on the near or on the far side.
    fn draw_curve(
        &self,
        canvas: &mut Canvas<'_>,
        curve: &[Vector3<f64>],
        stroke: Stroke,
        near: bool,
    ) {
        let stroke = if near { stroke } else { behind(stroke) };
        let mut run = Vec::new();
        for point in curve {
            run.push(self.place(point));
            if (self.camera.depth(point) >= 0.0) != near {
                if run.len() > 2 {
                    canvas.path(&run, stroke);
                }
                run.drain(..run.len() - 1);
            }
        }
        canvas.path(&run, stroke);
    }

    /// The ends of the principal axes outside the sphere, on the near or on the far side.
    fn draw_axes(&self, canvas: &mut Canvas<'_>, axes: &[Vector3<f64>; 3], near: bool) {
        let mut font = Font {
            size: style::HEADING,
            color: style::INK,
            anchor: Anchor::Middle,
        };
        let names = ["least J", "middle J", "greatest J"];
        for (axis, name) in axes.iter().zip(names) {
            for end in [*axis, -axis] {
                if (self.camera.depth(&end) >= 0.0) != near {
                    continue;
                }
                let stroke = Stroke::new(if near { style::INK } else { style::FRAME }, 1.6);
                canvas.path(&[self.place(&end), self.place(&(AXIS * end))], stroke);
                if near {
                    canvas.disc(self.place(&end), 3.0, style::INK);
                    let tip = self.place(&(AXIS * end));
                    let [across, down] = [0, 1].map(|i| (tip[i] - self.center[i]) / self.radius);
                    font.anchor = if across < 0.0 {
                        Anchor::End
                    } else {
                        Anchor::Start
                    };
                    let beside = if across < 0.0 { -8.0 } else { 8.0 };
                    canvas.text(name, [tip[0] + beside, tip[1] + 10.0 * down], font);
                }
            }
        }
    }
}

/// As seen through the sphere.
fn behind(stroke: Stroke) -> Stroke {
    use plotters::style::Color;
    Stroke {
        color: stroke.color.mix(0.3),
        width: stroke.width,
    }
}
