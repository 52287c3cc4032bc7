//! What the marks of a figure mean, in rows above it.

use plotters::style::RGBColor;

use super::canvas::{Anchor, Canvas, Font, Stroke, text_width};
use super::chart::Rectangle;
use super::{marks, style};

/// A sample of what an entry explains.
#[derive(Clone, Copy)]
pub(super) enum Mark {
    None,
    Line(Stroke),
    Dashes(Stroke),
    Arrow(Stroke),
    Start(RGBColor),
    End(RGBColor),
    Attractor,
}

/// A mark and its meaning.
pub(super) struct Entry {
    pub(super) mark: Mark,
    pub(super) text: String,
}

impl Entry {
    pub(super) fn new(mark: Mark, text: impl Into<String>) -> Self {
        Self {
            mark,
            text: text.into(),
        }
    }
}

/// Height of a row, distance of entries (px).
const ROW: f64 = 22.0;
const GAP: f64 = 18.0;

impl Mark {
    /// Room that it takes (px), its distance from the text included.
    fn width(self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Line(_) | Self::Dashes(_) | Self::Arrow(_) => 32.0,
            Self::Start(_) | Self::End(_) | Self::Attractor => 22.0,
        }
    }

    fn draw(self, canvas: &mut Canvas<'_>, x: f64, y: f64) {
        let line = [[x, y], [x + 25.0, y]];
        match self {
            Self::None => {}
            Self::Line(stroke) => canvas.path(&line, stroke),
            Self::Dashes(stroke) => canvas.dashed(&line, stroke, [7.0, 4.0]),
            Self::Arrow(stroke) => canvas.arrow(line[0], line[1], stroke),
            Self::Start(color) => marks::start(canvas, [x + 8.0, y], color),
            Self::End(color) => marks::end(canvas, [x + 8.0, y], color),
            Self::Attractor => marks::attractor(canvas, [x + 8.0, y], 0.0),
        }
    }
}

/// The entries' rows and distances from the left (px).
fn places(entries: &[Entry], width: f64) -> Vec<[f64; 2]> {
    let (mut x, mut row) = (0.0, 0.0);
    entries
        .iter()
        .map(|entry| {
            let length = entry.mark.width() + text_width(&entry.text, style::LABEL);
            if x > 0.0 && x + length > width {
                (x, row) = (0.0, row + 1.0);
            }
            let place = [x, row];
            x += length + GAP;
            place
        })
        .collect()
}

/// Height that the legend takes in a space (px).
pub(super) fn legend_height(entries: &[Entry], space: Rectangle) -> f64 {
    let places = places(entries, space.to[0] - space.from[0]);
    places.last().map_or(0.0, |[_, row]| (row + 1.0) * ROW)
}

/// Draws the legend at the top of a space.
pub(super) fn draw_legend(canvas: &mut Canvas<'_>, entries: &[Entry], space: Rectangle) {
    let font = Font {
        size: style::LABEL,
        color: style::INK,
        anchor: Anchor::Start,
    };
    let places = places(entries, space.to[0] - space.from[0]);
    for (entry, [x, row]) in entries.iter().zip(places) {
        let (x, y) = (space.from[0] + x, space.from[1] + (row + 0.5) * ROW);
        entry.mark.draw(canvas, x, y);
        canvas.text(&entry.text, [x + entry.mark.width(), y], font);
    }
}
