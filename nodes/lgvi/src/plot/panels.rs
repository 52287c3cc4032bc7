//! Curves over time alone, as a picture.

use lgvi_middleware::node::NodeError;
use plotters::style::Color;

use super::canvas::{Anchor, Canvas, Font, picture};
use super::chart::{self, Rectangle};
use super::style;

pub(crate) use super::series::{Curve, Panel};

/// Width, heights of the title and of a panel (px).
const WIDTH: f64 = 720.0;
const TITLE: f64 = 40.0;
const PANEL: f64 = 220.0;

/// The picture of panels below a title, as an SVG document.
pub(crate) fn draw(title: &str, panels: &[Panel]) -> Result<String, NodeError> {
    let height = TITLE + PANEL * panels.len() as f64;
    picture(
        [WIDTH as u32, height as u32],
        title,
        |canvas: &mut Canvas<'_>| {
            let corners = [[0.0, 0.0], [WIDTH, 0.0], [WIDTH, height], [0.0, height]];
            canvas.area(&corners, style::PAPER.to_rgba());
            let font = Font {
                size: style::TITLE,
                color: style::INK,
                anchor: Anchor::Start,
            };
            canvas.text(title, [16.0, 24.0], font);
            let space = Rectangle {
                from: [8.0, TITLE],
                to: [WIDTH - 16.0, height - 8.0],
            };
            chart::draw(canvas, space, panels);
        },
    )
}
