//! Curves over time in a frame with axes.

use super::canvas::{Anchor, Canvas, Font, Place, Stroke, text_width};
use super::series::Panel;
use super::style;
use super::ticks::{Ticks, exponent, unit};

/// Upper left and lower right corner (px).
#[derive(Clone, Copy, Debug)]
pub(super) struct Rectangle {
    pub(super) from: Place,
    pub(super) to: Place,
}

/// Room above the frame for a row of the heading, below it for ticks and label of the time (px).
const ROW: f64 = 24.0;
const BELOW: f64 = 25.0;
const TIME_LABEL: f64 = 23.0;

/// Room left of the frame for tick labels (px).
const LEFT: f64 = 62.0;

/// Room of a sample of a curve, and between it and the next (px).
const SAMPLE: f64 = 23.0;
const GAP: f64 = 14.0;

/// Part of its range that stays free beyond a curve.
const FREE: f64 = 0.06;

/// Draws the panels one below the other, with one time axis.
pub(super) fn draw(canvas: &mut Canvas<'_>, space: Rectangle, panels: &[Panel]) {
    let Rectangle { from, to } = space;
    let height = (to[1] - from[1] - TIME_LABEL) / panels.len().max(1) as f64;
    let points = || {
        panels
            .iter()
            .flat_map(|panel| &panel.curves)
            .flat_map(|curve| &curve.points)
    };
    let time = range(points().map(|point| point[0]), 0.0);
    let (per_unit, time_unit) = time_unit(time[1] - time[0]);
    for (index, panel) in panels.iter().enumerate() {
        let top = from[1] + index as f64 * height;
        let rows = heading(canvas, [from[0], top], to[0], panel);
        let frame = Rectangle {
            from: [from[0] + LEFT, top + ROW * rows + 7.0],
            to: [to[0], top + height - BELOW],
        };
        Axes::new(frame, time, panel).draw(canvas, panel, per_unit);
    }
    let font = Font {
        size: style::LABEL,
        color: style::INK,
        anchor: Anchor::Middle,
    };
    let center = (from[0] + LEFT + to[0]) / 2.0;
    canvas.text(&format!("Time [{time_unit}]"), [center, to[1] - 9.0], font);
}

/// Seconds in the unit that gives short labels of a duration (s), and its symbol; the page of `lgvi report` has the same.
pub(super) fn time_unit(duration: f64) -> (f64, &'static str) {
    match duration {
        ..600.0 => (1.0, "s"),
        ..10_800.0 => (60.0, "min"),
        ..172_800.0 => (3600.0, "h"),
        _ => (86_400.0, "d"),
    }
}

/// Least and greatest, widened by a part of their distance; around a constant, wide enough to call it constant.
fn range(values: impl Iterator<Item = f64>, free: f64) -> [f64; 2] {
    let bounds = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = values.fold(bounds, |[low, high], value| {
        [low.min(value), high.max(value)]
    });
    let size = low.abs().max(high.abs());
    let span = high - low;
    if !span.is_finite() || size == 0.0 {
        return [-1.0, 1.0];
    }
    if span <= 1e-9 * size {
        return [low - 0.1 * size, high + 0.1 * size];
    }
    [low - free * span, high + free * span]
}

/// Title and unit on the left, legend on the right, of the next row where they would meet; the rows that it took.
fn heading(canvas: &mut Canvas<'_>, from: Place, right: f64, panel: &Panel) -> f64 {
    let mut font = Font {
        size: style::HEADING,
        color: style::INK,
        anchor: Anchor::Start,
    };
    let unit = match unit(power(panel), panel.unit) {
        unit if unit.is_empty() => "–".into(),
        unit => unit,
    };
    let title = format!("{} [{unit}]", panel.title);
    let mut y = from[1] + 0.5 * ROW + 2.0;
    let room = right + 12.0 - from[0] - 8.0;
    font.size *= (room / text_width(&title, font.size)).min(1.0);
    canvas.text(&title, [from[0] + 8.0, y], font);

    let mut entries: Vec<_> = panel
        .curves
        .iter()
        .filter(|curve| !curve.label.is_empty())
        .map(|curve| (curve.label.as_str(), Stroke::new(curve.color, 2.4)))
        .collect();
    if !panel.limits.is_empty() {
        entries.push(("limit", limit()));
    }
    if entries.is_empty() {
        return 1.0;
    }
    let widths = entries
        .iter()
        .map(|(label, _)| SAMPLE + text_width(label, style::LABEL));
    let width = widths.sum::<f64>() + GAP * (entries.len() - 1) as f64;
    let fits = from[0] + 8.0 + text_width(&title, style::HEADING) + GAP + width <= right;
    let rows = if fits { 1.0 } else { 2.0 };
    y += ROW * (rows - 1.0);
    font.size = style::LABEL;
    let mut x = right - width;
    for (label, stroke) in entries {
        let sample = [[x, y], [x + SAMPLE - 5.0, y]];
        if label == "limit" {
            canvas.dashed(&sample, stroke, [6.0, 4.0]);
        } else {
            canvas.path(&sample, stroke);
        }
        canvas.text(label, [x + SAMPLE, y], font);
        x += SAMPLE + text_width(label, font.size) + GAP;
    }
    rows
}

fn limit() -> Stroke {
    Stroke::new(style::LIMIT, 1.6)
}

/// The power of ten taken out of the panel's values.
fn power(panel: &Panel) -> i32 {
    exponent(values(panel).map(f64::abs).fold(0.0, f64::max))
}

/// All that a panel shows.
fn values(panel: &Panel) -> impl Iterator<Item = f64> {
    let points = panel.curves.iter().flat_map(|curve| &curve.points);
    points
        .map(|point| point[1])
        .chain(panel.limits.iter().copied())
}

/// Where values are in a frame.
struct Axes {
    frame: Rectangle,
    time: [f64; 2],
    value: [f64; 2],
    /// What the values are divided by.
    scale: f64,
}

impl Axes {
    fn new(frame: Rectangle, time: [f64; 2], panel: &Panel) -> Self {
        let scale = libm::exp10(f64::from(power(panel)));
        let value = range(values(panel).map(|value| value / scale), FREE);
        Self {
            frame,
            time,
            value,
            scale,
        }
    }

    fn x(&self, time: f64) -> f64 {
        let Rectangle { from, to } = self.frame;
        from[0] + (time - self.time[0]) / (self.time[1] - self.time[0]) * (to[0] - from[0])
    }

    fn y(&self, value: f64) -> f64 {
        let Rectangle { from, to } = self.frame;
        to[1] - (value - self.value[0]) / (self.value[1] - self.value[0]) * (to[1] - from[1])
    }

    fn draw(&self, canvas: &mut Canvas<'_>, panel: &Panel, per_unit: f64) {
        let Rectangle { from, to } = self.frame;
        let grid = Stroke::new(style::GRID, 1.0);
        let mut font = Font {
            size: style::LABEL,
            color: style::SOFT_INK,
            anchor: Anchor::End,
        };
        let rows = ((to[1] - from[1]) / 28.0).clamp(3.0, 8.0) as u32;
        // One number says nothing of the scale.
        let ticks = (rows..2 * rows + 2)
            .map(|rows| Ticks::new(self.value[0], self.value[1], rows))
            .find(|ticks| ticks.values.len() > 1);
        let ticks = ticks.unwrap_or_else(|| Ticks::new(self.value[0], self.value[1], rows));
        for value in &ticks.values {
            let y = self.y(*value);
            let stroke = if *value == 0.0 {
                Stroke::new(style::FRAME, 1.0)
            } else {
                grid
            };
            canvas.path(&[[from[0], y], [to[0], y]], stroke);
            canvas.text(&ticks.label(*value), [from[0] - 7.0, y], font);
        }
        font.anchor = Anchor::Middle;
        let ticks = Ticks::new(self.time[0] / per_unit, self.time[1] / per_unit, 5);
        for time in &ticks.values {
            let x = self.x(*time * per_unit);
            canvas.path(&[[x, from[1]], [x, to[1]]], grid);
            canvas.text(&ticks.label(*time), [x, to[1] + 13.0], font);
        }
        let corners = [from, [to[0], from[1]], to, [from[0], to[1]], from];
        canvas.path(&corners, Stroke::new(style::FRAME, 1.0));
        for value in &panel.limits {
            let y = self.y(value / self.scale);
            canvas.dashed(&[[from[0], y], [to[0], y]], limit(), [6.0, 4.0]);
        }
        for curve in &panel.curves {
            let place = |point: &[f64; 2]| [self.x(point[0]), self.y(point[1] / self.scale)];
            let points: Vec<_> = curve.points.iter().map(place).collect();
            let [width, height] = [0, 1].map(|i| to[i] - from[i]);
            let stroke = Stroke::new(curve.color, 1.8).within(&[&points], width * height);
            canvas.path(&points, stroke);
        }
    }
}
