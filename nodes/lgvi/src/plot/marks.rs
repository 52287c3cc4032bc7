//! What is drawn of a flight in space, and how.

use plotters::style::{Color, RGBColor};

use super::canvas::{Canvas, Place, Stroke};
use super::style;

/// What is drawn at a depth.
pub(super) enum Item {
    Piece(Vec<Place>, Stroke),
    Face([Place; 3], RGBColor),
    Bar(Vec<Place>, RGBColor),
    Ball(Place, f64, RGBColor),
    Axis(Place, Place, RGBColor),
    Force(Place, Place),
    /// With its radius (px).
    Attractor(Place, f64),
    Start(Place, RGBColor),
    End(Place, RGBColor),
}

impl Item {
    pub(super) fn draw(self, canvas: &mut Canvas<'_>) {
        match self {
            Self::Piece(places, stroke) => canvas.path(&places, stroke),
            Self::Face(corners, color) => {
                canvas.area(&corners, color.to_rgba());
                // Closes the gaps to its neighbors.
                let [a, b, c] = corners;
                canvas.path(&[a, b, c, a], Stroke::new(color, 0.6));
            }
            Self::Bar(places, color) => {
                canvas.path(&places, Stroke::new(style::PAPER, 4.0));
                canvas.path(&places, Stroke::new(darker(color), 2.2));
            }
            Self::Ball(place, radius, color) => {
                canvas.ringed(place, radius, color, Stroke::new(darker(color), 1.0));
            }
            Self::Axis(from, to, color) => canvas.path(&[from, to], Stroke::new(color, 1.8)),
            Self::Force(from, to) => canvas.arrow(from, to, force()),
            Self::Attractor(place, radius) => attractor(canvas, place, radius),
            Self::Start(place, color) => start(canvas, place, color),
            Self::End(place, color) => end(canvas, place, color),
        }
    }
}

pub(super) fn initial_orbit() -> Stroke {
    Stroke::new(style::SOFT_INK, 1.3)
}

pub(super) fn target_orbit() -> Stroke {
    Stroke::new(style::TARGET, 1.5)
}

/// Of a corridor.
pub(super) fn boundary() -> Stroke {
    Stroke::new(style::TARGET, 1.8)
}

pub(super) fn force() -> Stroke {
    Stroke::new(style::FORCE, 1.5)
}

/// To scale, unless it would be too small.
pub(super) fn attractor(canvas: &mut Canvas<'_>, place: Place, radius: f64) {
    let pale = if radius > 40.0 { 0.6 } else { 0.0 };
    canvas.ringed(
        place,
        radius.max(8.0),
        style::faded(style::ATTRACTOR, pale),
        Stroke::new(darker(style::ATTRACTOR), 1.2),
    );
}

pub(super) fn start(canvas: &mut Canvas<'_>, place: Place, color: RGBColor) {
    canvas.ringed(place, 5.0, style::PAPER, Stroke::new(color, 2.4));
}

pub(super) fn end(canvas: &mut Canvas<'_>, place: Place, color: RGBColor) {
    canvas.diamond(place, 6.5, color, Stroke::new(style::PAPER, 1.3));
}

pub(super) fn darker(color: RGBColor) -> RGBColor {
    let part = |c: u8| (f64::from(c) * 0.72) as u8;
    RGBColor(part(color.0), part(color.1), part(color.2))
}
