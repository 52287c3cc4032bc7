//! The box around a scene in space: its far walls with a grid, and its near edges with numbers. The same scale on all
//! axes.

use nalgebra::Vector3;
use plotters::style::Color;

use super::canvas::{Anchor, Canvas, Font, Place, Stroke, text_width};
use super::chart::Rectangle;
use super::style;
use super::ticks::{Ticks, exponent, step, unit};
use super::view::Camera;

/// Room around the box for its numbers (px).
const MARGIN: [f64; 2] = [72.0, 46.0];

/// Distance of numbers from the ends of their edge (px).
const CORNER: f64 = 14.0;

/// Least length of an edge, of the longest.
const FLATTEST: f64 = 0.12;

/// Axes shorter than this, of the longest, have no room for numbers of their own.
const NUMBERED: f64 = 0.2;

/// A box of space, and where it lies in the picture.
pub(super) struct Cage {
    pub(super) camera: Camera,
    low: Vector3<f64>,
    high: Vector3<f64>,
    /// [px/m]
    pub(super) scale: f64,
    /// Of the inertial origin (px).
    origin: Place,
}

impl Cage {
    /// Holds all `points`, as large as fits into `space`.
    pub(super) fn around(points: &[Vector3<f64>], camera: Camera, space: Rectangle) -> Self {
        let start = points.first().copied().unwrap_or_default();
        let (low, high) = points.iter().fold((start, start), |(low, high), point| {
            (low.inf(point), high.sup(point))
        });
        let longest = match (high - low).max() {
            0.0 => 1.0,
            longest => longest,
        };
        let half = (0.5 * (high - low)).map(|half| (1.06 * half).max(0.5 * FLATTEST * longest));
        let middle = 0.5 * (low + high);
        let mut cage = Self {
            camera,
            low: middle - half,
            high: middle + half,
            scale: 1.0,
            origin: [0.0; 2],
        };
        let corners: Vec<_> = (0..8)
            .map(|k| cage.corner([k & 1 != 0, k & 2 != 0, k & 4 != 0]))
            .map(|corner| cage.place(&corner))
            .collect();
        let bounds = |axis: usize| {
            let ends = [f64::INFINITY, f64::NEG_INFINITY];
            corners
                .iter()
                .map(|corner| corner[axis])
                .fold(ends, |[a, b], c| [a.min(c), b.max(c)])
        };
        let (across, down) = (bounds(0), bounds(1));
        let room = [0, 1].map(|axis| space.to[axis] - space.from[axis] - 2.0 * MARGIN[axis]);
        cage.scale = (room[0] / (across[1] - across[0])).min(room[1] / (down[1] - down[0]));
        cage.origin = [0, 1].map(|axis| {
            let [near, far] = if axis == 0 { across } else { down };
            0.5 * (space.from[axis] + space.to[axis]) - cage.scale * 0.5 * (near + far)
        });
        cage
    }

    /// Where a point of space is in the picture.
    pub(super) fn place(&self, point: &Vector3<f64>) -> Place {
        let seen = self.camera.project(point);
        [
            self.origin[0] + self.scale * seen.x,
            self.origin[1] - self.scale * seen.y,
        ]
    }

    /// Greater is nearer; 0 to 1 from the farthest to the nearest corner.
    pub(super) fn nearness(&self, point: &Vector3<f64>) -> f64 {
        let far = self
            .camera
            .depth(&self.corner([0, 1, 2].map(|axis| !self.near_is_high(axis))));
        let near = self
            .camera
            .depth(&self.corner([0, 1, 2].map(|axis| self.near_is_high(axis))));
        (self.camera.depth(point) - far) / (near - far)
    }

    /// Cosine of the angle between a direction and that to the viewer.
    pub(super) fn lit(&self, direction: &Vector3<f64>) -> f64 {
        let length = direction.norm();
        if length > 0.0 {
            self.camera.depth(direction) / length
        } else {
            0.0
        }
    }

    fn near_is_high(&self, axis: usize) -> bool {
        self.camera.depth(&Vector3::ith(axis, 1.0)) > 0.0
    }

    fn corner(&self, high: [bool; 3]) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| {
            if high[axis] {
                self.high[axis]
            } else {
                self.low[axis]
            }
        })
    }

    /// The three far walls and their grid.
    pub(super) fn draw_walls(&self, canvas: &mut Canvas<'_>) {
        let far = [0, 1, 2].map(|axis| !self.near_is_high(axis));
        let ticks = self.ticks();
        for wall in 0..3 {
            let [a, b] = [(wall + 1) % 3, (wall + 2) % 3];
            let at = |on_a: f64, on_b: f64| {
                let mut point = self.corner(far);
                point[a] = on_a;
                point[b] = on_b;
                self.place(&point)
            };
            let (a_ends, b_ends) = ([self.low[a], self.high[a]], [self.low[b], self.high[b]]);
            let outline = [
                at(a_ends[0], b_ends[0]),
                at(a_ends[1], b_ends[0]),
                at(a_ends[1], b_ends[1]),
                at(a_ends[0], b_ends[1]),
                at(a_ends[0], b_ends[0]),
            ];
            canvas.area(&outline[..4], style::WALL.to_rgba());
            let grid = Stroke::new(style::GRID, 1.0);
            for value in &ticks[a].values {
                canvas.path(&[at(*value, b_ends[0]), at(*value, b_ends[1])], grid);
            }
            for value in &ticks[b].values {
                canvas.path(&[at(a_ends[0], *value), at(a_ends[1], *value)], grid);
            }
            canvas.path(&outline, Stroke::new(style::FRAME, 1.0));
        }
    }

    /// The numbers along an edge of each axis, with the unit.
    pub(super) fn draw_numbers(&self, canvas: &mut Canvas<'_>) {
        let (scale, unit) = self.unit();
        let middle = self.place(&(0.5 * (self.low + self.high)));
        let ticks = self.ticks();
        for axis in 0..3 {
            let (from, to) = self.edge(axis);
            let ends = [self.place(&from), self.place(&to)];
            let along = [0, 1].map(|i| ends[1][i] - ends[0][i]);
            let length = libm::hypot(along[0], along[1]);
            if length < 30.0 {
                continue;
            }
            // Away from the box, across the edge.
            let mut away = [-along[1] / length, along[0] / length];
            let center = [0, 1].map(|i| 0.5 * (ends[0][i] + ends[1][i]));
            if (0..2)
                .map(|i| away[i] * (center[i] - middle[i]))
                .sum::<f64>()
                < 0.0
            {
                away = away.map(|c| -c);
            }
            let anchor = match away[0] {
                ..-0.5 => Anchor::End,
                0.5.. => Anchor::Start,
                _ => Anchor::Middle,
            };
            let mut font = Font {
                size: style::LABEL,
                color: style::SOFT_INK,
                anchor,
            };
            // Numbers that would crowd are left out.
            let spacing = length * self.step(axis) / (self.high[axis] - self.low[axis]);
            let wide = 34.0 * (along[0] / length).abs() + 17.0 * (along[1] / length).abs();
            let every = (wide / spacing).ceil().max(1.0) as usize;
            let [low, high, step] =
                [self.low[axis], self.high[axis], self.step(axis)].map(|c| c / scale);
            let numbers = Ticks::with_step(low, high, step);
            let placed = ticks[axis].values.iter().zip(&numbers.values);
            let placed = placed.map(|(value, number)| {
                let mut point = from;
                point[axis] = *value;
                (self.place(&point), number)
            });
            // Two axes meet at a corner: there is no room for the numbers of both.
            let clear = placed.filter(|(place, _)| {
                let from_end = |end: &Place| libm::hypot(place[0] - end[0], place[1] - end[1]);
                ends.iter().all(|end| from_end(end) >= CORNER)
            });
            for (place, number) in clear.step_by(every) {
                let beside = |gap: f64| [0, 1].map(|i| place[i] + gap * away[i]);
                canvas.path(&[place, beside(5.0)], Stroke::new(style::FRAME, 1.0));
                canvas.text(&numbers.label(*number), beside(13.0), font);
            }
            font.color = style::INK;
            font.size = style::HEADING;
            let widest = numbers
                .values
                .iter()
                .map(|value| text_width(&numbers.label(*value), style::LABEL));
            let beyond = 32.0 + widest.fold(0.0, f64::max) * away[0].abs();
            let name = if axis == 2 {
                font.anchor = Anchor::Middle;
                let [x, y] = if ends[0][1] < ends[1][1] {
                    ends[0]
                } else {
                    ends[1]
                };
                [x, y - 15.0]
            } else {
                [0, 1].map(|i| center[i] + beyond * away[i])
            };
            canvas.text(&format!("{} [{unit}]", ["x", "y", "z"][axis]), name, font);
        }
    }

    /// What one unit of the numbers measures (m), and its name.
    fn unit(&self) -> (f64, String) {
        let greatest = self.low.amax().max(self.high.amax());
        let (size, symbol) = if greatest < 1e4 {
            (1.0, "m")
        } else {
            (1e3, "km")
        };
        // Five digits are still short: an orbit of the Earth is best in kilometers.
        let power = match greatest / size {
            1e4..1e5 => 0,
            greatest => exponent(greatest),
        };
        (size * libm::exp10(f64::from(power)), unit(power, symbol))
    }

    /// Where the grid is (m).
    fn ticks(&self) -> [Ticks; 3] {
        [0, 1, 2].map(|axis| Ticks::with_step(self.low[axis], self.high[axis], self.step(axis)))
    }

    /// That of the longest axis, unless it leaves one number or none (m).
    fn step(&self, axis: usize) -> f64 {
        let size = self.high - self.low;
        let common = step(size.max(), 7);
        let few = size[axis] < 3.0 * common;
        if few && size[axis] > NUMBERED * size.max() {
            step(size[axis], 6)
        } else {
            common
        }
    }

    /// The edge that carries an axis's numbers: on the floor's near side, and upright where the outline ends.
    fn edge(&self, axis: usize) -> (Vector3<f64>, Vector3<f64>) {
        let near = [0, 1, 2].map(|axis| self.near_is_high(axis));
        let floor = self.camera.is_hanging();
        let mut corner = [near[0], near[1], floor];
        if axis == 2 {
            let sides = [[near[0], !near[1], floor], [!near[0], near[1], floor]];
            corner = sides[0];
            if self.place(&self.corner(sides[1]))[0] < self.place(&self.corner(sides[0]))[0] {
                corner = sides[1];
            }
        }
        let mut ends = [corner, corner];
        ends[0][axis] = false;
        ends[1][axis] = true;
        (self.corner(ends[0]), self.corner(ends[1]))
    }
}
