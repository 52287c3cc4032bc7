//! The unit sphere of directions, with curves on it.

use nalgebra::Vector3;
use plotters::style::{Color, RGBColor};

use super::canvas::{Anchor, Canvas, Font, Place, Stroke};
use super::chart::Rectangle;
use super::legend::{Entry, draw_legend, legend_height};
use super::style;
use super::view::Camera;

/// Length of the axes, radius of the sphere 1.
const AXIS: f64 = 1.12;

/// Room beside the axes for their names (px).
const NAMES: f64 = 26.0;

/// Where the unit sphere is in the picture.
pub(super) struct Globe {
    camera: Camera,
    center: Place,
    radius: f64,
}

/// A curve of unit vectors.
pub(super) type Curve = (Vec<Vector3<f64>>, Stroke);

/// What is drawn on a sphere.
pub(super) struct Content<'a> {
    pub(super) legend: Vec<Entry>,
    pub(super) axes: [Vector3<f64>; 3],
    pub(super) names: [&'a str; 3],
    /// Areas round a direction, by their rims.
    pub(super) caps: Vec<Vec<Vector3<f64>>>,
    pub(super) curves: Vec<Curve>,
}

/// Draws the sphere into `space`, below its legend.
pub(super) fn draw(
    canvas: &mut Canvas<'_>,
    space: Rectangle,
    camera: Camera,
    content: &Content<'_>,
) -> Globe {
    draw_legend(canvas, &content.legend, space);
    let top = space.from[1] + legend_height(&content.legend, space);
    let half = [
        0.5 * (space.to[0] - space.from[0]),
        0.5 * (space.to[1] - top),
    ];
    let globe = Globe {
        camera,
        center: [space.from[0] + half[0], top + half[1]],
        radius: (half[0].min(half[1]) - NAMES) / AXIS,
    };
    globe.draw_axes(canvas, content, false);
    globe.draw_ball(canvas);
    for near in [false, true] {
        for rim in &content.caps {
            globe.draw_cap(canvas, rim, near);
        }
        for (curve, stroke) in &content.curves {
            globe.draw_curve(canvas, curve, *stroke, near);
        }
    }
    globe.draw_axes(canvas, content, true);
    globe
}

impl Globe {
    pub(super) fn place(&self, point: &Vector3<f64>) -> Place {
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

    /// The area within a rim that lies on the near or on the far side.
    fn draw_cap(&self, canvas: &mut Canvas<'_>, rim: &[Vector3<f64>], near: bool) {
        let there = rim
            .iter()
            .filter(|point| (self.camera.depth(point) >= 0.0) == near);
        let places: Vec<_> = there.map(|point| self.place(point)).collect();
        if places.len() > 2 {
            let strength = if near { 0.16 } else { 0.06 };
            canvas.area(&places, style::LIMIT.mix(strength));
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

    /// The ends of the axes outside the sphere, on the near or on the far side.
    fn draw_axes(&self, canvas: &mut Canvas<'_>, content: &Content<'_>, near: bool) {
        let mut font = Font {
            size: style::HEADING,
            color: style::INK,
            anchor: Anchor::Middle,
        };
        for (axis, name) in content.axes.iter().zip(content.names) {
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
                    let place = [tip[0] + beside, tip[1] + 10.0 * down];
                    // A letter stays readable where it is on a curve.
                    if name.len() == 1 {
                        let middle = place[0] + 0.5 * beside.signum() * style::HEADING * 0.6;
                        canvas.disc([middle, place[1]], 0.6 * style::HEADING, style::PAPER);
                    }
                    canvas.text(name, place, font);
                }
            }
        }
    }
}

/// As seen through the sphere.
fn behind(stroke: Stroke) -> Stroke {
    Stroke {
        color: stroke.color.mix(0.3),
        width: stroke.width,
    }
}
