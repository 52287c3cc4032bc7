//! A sheet to draw on, in fractions of a pixel.
//!
//! plotters' SVG backend takes whole numbers only, which makes curves jagged. So the sheet is [`FINE`] times the size of
//! the picture, and the picture's `viewBox` shows it smaller. Its charts are not used: they would look up fonts to lay
//! out text, and its axes stop the program at ranges as small as an energy error. Text goes out as SVG `<text>`; a
//! viewer's own sans-serif font draws it.

use std::fmt::Display;

use lgvi_middleware::node::NodeError;
use plotters::backend::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    Color, FontFamily, FontTransform, RGBAColor, RGBColor, ShapeStyle, TextStyle,
};

/// Units of the sheet a pixel.
const FINE: f64 = 10.0;

/// Part of an area that a line may cover, and the width at which it covers more nevertheless (px).
const INK: f64 = 0.35;
const THINNEST: f64 = 0.5;

/// A place in the picture (px), from the upper left.
pub(super) type Place = [f64; 2];

/// Color, opacity and width (px) of a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stroke {
    pub(super) color: RGBAColor,
    pub(super) width: f64,
}

impl Stroke {
    pub(super) fn new(color: RGBColor, width: f64) -> Self {
        Self {
            color: color.to_rgba(),
            width,
        }
    }

    /// Thinner if paths are so long that they would fill an area (px²): what goes back and forth stays a line.
    pub(super) fn within(self, paths: &[&[Place]], area: f64) -> Self {
        let steps = paths.iter().flat_map(|path| path.windows(2));
        let length: f64 = steps.map(|step| distance(step[0], step[1])).sum();
        let width = INK * area / length.max(f64::MIN_POSITIVE);
        Self {
            width: width.clamp(THINNEST.min(self.width), self.width),
            ..self
        }
    }

    fn style(self) -> ShapeStyle {
        let stroke_width = (self.width * FINE).round() as u32;
        ShapeStyle::from(self.color).stroke_width(stroke_width)
    }
}

/// Which part of a text is at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Size (px), color and anchor of a text, which is centered vertically.
#[derive(Clone, Copy, Debug)]
pub(super) struct Font {
    pub(super) size: f64,
    pub(super) color: RGBColor,
    pub(super) anchor: Anchor,
}

/// Width (px) that a text takes in wide sans-serif fonts, for the viewer's is not known.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let em = |c: char| match c {
        ' ' | '.' | ',' | 'i' | 'j' | 'l' | '|' | '°' => 0.33,
        'f' | 'r' | 't' | '/' | '(' | ')' | '[' | ']' => 0.41,
        'm' | 'w' | 'M' | 'W' | '−' | '×' => 0.92,
        'A'..='Z' => 0.72,
        _ => 0.63,
    };
    size * text.chars().map(em).sum::<f64>()
}

/// The sheet.
pub(super) struct Canvas<'a> {
    backend: SVGBackend<'a>,
    error: Option<NodeError>,
}

/// The picture of `size` (px) that `paint` draws, as an SVG document.
pub(super) fn picture(
    size: [u32; 2],
    title: &str,
    paint: impl FnOnce(&mut Canvas<'_>),
) -> Result<String, NodeError> {
    let [width, height] = size;
    let mut body = String::new();
    {
        let fine = size.map(|length| length * FINE as u32);
        let mut canvas = Canvas {
            backend: SVGBackend::with_string(&mut body, fine.into()),
            error: None,
        };
        paint(&mut canvas);
        if let Some(error) = canvas.error {
            return Err(error);
        }
        canvas.backend.present().map_err(NodeError::runtime)?;
    }
    let shapes = body.split_once('>').map_or("", |(_, shapes)| shapes);
    let [fine_width, fine_height] = size.map(|length| f64::from(length) * FINE);
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {fine_width} {fine_height}\" stroke-linejoin=\"round\">\n<title>{title}</title>{shapes}"
    ))
}

impl Canvas<'_> {
    fn note(&mut self, outcome: Result<(), impl Display>) {
        if let Err(error) = outcome {
            self.error
                .get_or_insert(NodeError::Runtime(error.to_string()));
        }
    }

    pub(super) fn path(&mut self, points: &[Place], stroke: Stroke) {
        if points.len() > 1 {
            let outcome = self.backend.draw_path(fine_path(points), &stroke.style());
            self.note(outcome);
        }
    }

    /// A path of dashes and gaps (px).
    pub(super) fn dashed(&mut self, points: &[Place], stroke: Stroke, [dash, gap]: [f64; 2]) {
        let mut drawn = Vec::new();
        let (mut on, mut left) = (true, dash);
        for pair in points.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            let length = distance(from, to);
            let mut at = 0.0;
            if on && drawn.is_empty() {
                drawn.push(from);
            }
            while length - at > left {
                at += left;
                let turn = [0, 1].map(|i| from[i] + (to[i] - from[i]) * at / length);
                if on {
                    drawn.push(turn);
                    self.path(&drawn, stroke);
                    drawn.clear();
                } else {
                    drawn.push(turn);
                }
                on = !on;
                left = if on { dash } else { gap };
            }
            left -= length - at;
            if on {
                drawn.push(to);
            }
        }
        self.path(&drawn, stroke);
    }

    pub(super) fn area(&mut self, points: &[Place], color: RGBAColor) {
        let outcome = self.backend.fill_polygon(fine_path(points), &color);
        self.note(outcome);
    }

    pub(super) fn disc(&mut self, center: Place, radius: f64, color: RGBColor) {
        let radius = (radius * FINE).round() as u32;
        let outcome = self.backend.draw_circle(fine(center), radius, &color, true);
        self.note(outcome);
    }

    /// A disc with an edge.
    pub(super) fn ringed(&mut self, center: Place, radius: f64, fill: RGBColor, edge: Stroke) {
        self.disc(center, radius, fill);
        let radius = (radius * FINE).round() as u32;
        let outcome = self
            .backend
            .draw_circle(fine(center), radius, &edge.style(), false);
        self.note(outcome);
    }

    /// A square with an edge, standing on its tip.
    pub(super) fn diamond(&mut self, [x, y]: Place, radius: f64, fill: RGBColor, edge: Stroke) {
        let corners = [
            [x, y - radius],
            [x + radius, y],
            [x, y + radius],
            [x - radius, y],
        ];
        self.area(&corners, fill.to_rgba());
        let [first, second, ..] = corners;
        self.path(&[&corners[..], &[first, second]].concat(), edge);
    }

    /// A line with a head at its end.
    pub(super) fn arrow(&mut self, from: Place, to: Place, stroke: Stroke) {
        let length = distance(from, to);
        if length < 0.5 {
            return;
        }
        let along = [0, 1].map(|i| (to[i] - from[i]) / length);
        let head = (3.2 * stroke.width + 1.5).min(0.6 * length);
        let point = |back: f64, aside: f64| {
            [
                to[0] - back * along[0] - aside * along[1],
                to[1] - back * along[1] + aside * along[0],
            ]
        };
        self.path(&[from, point(0.8 * head, 0.0)], stroke);
        self.area(
            &[to, point(head, 0.42 * head), point(head, -0.42 * head)],
            stroke.color,
        );
    }

    pub(super) fn text(&mut self, text: &str, place: Place, font: Font) {
        self.write(text, place, font, FontTransform::None);
    }

    fn write(&mut self, text: &str, place: Place, font: Font, transform: FontTransform) {
        let horizontal = match font.anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::End => HPos::Right,
        };
        // The backend writes 1/1.24 of the size; vertical centring is left to us, for not every viewer knows `ex`.
        let size = (font.size * FINE * 1.24).round();
        let style = TextStyle::from((FontFamily::SansSerif, size))
            .color(&font.color)
            .pos(Pos::new(horizontal, VPos::Top))
            .transform(transform);
        let place = fine([place[0], place[1] - 0.4 * font.size]);
        let outcome = self.backend.draw_text(text, &style, place);
        self.note(outcome);
    }
}

fn distance(from: Place, to: Place) -> f64 {
    libm::hypot(to[0] - from[0], to[1] - from[1])
}

fn fine(place: Place) -> (i32, i32) {
    let [x, y] = place.map(|c| (c * FINE).round() as i32);
    (x, y)
}

fn fine_path(points: &[Place]) -> Vec<(i32, i32)> {
    let mut path: Vec<_> = points.iter().map(|point| fine(*point)).collect();
    path.dedup();
    path
}
