//! The whole picture: title, motion on the left, curves over time on the right.

use lgvi_middleware::node::NodeError;
use plotters::style::Color;

use super::canvas::{Anchor, Font, picture, text_width};
use super::chart::{self, Rectangle};
use super::data::FlightData;
use super::{series, space, sphere, style};

/// (px)
const SIZE: [u32; 2] = [1280, 800];
const LEFT: Rectangle = Rectangle {
    from: [28.0, 88.0],
    to: [776.0, 788.0],
};
const RIGHT: Rectangle = Rectangle {
    from: [796.0, 20.0],
    to: [1260.0, 794.0],
};

/// The picture of a flight, as an SVG document.
pub(super) fn draw(flight: &FlightData) -> Result<String, NodeError> {
    let free_body = sphere::is_free_body(flight);
    let panels = series::panels(flight, free_body);
    picture(SIZE, &flight.scene.title, |canvas| {
        let [width, height] = SIZE.map(f64::from);
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
        canvas.area(&corners, style::PAPER.to_rgba());
        let width = text_width(&flight.scene.title, style::TITLE);
        let mut font = Font {
            size: style::TITLE * ((LEFT.to[0] - LEFT.from[0]) / width).min(1.0),
            color: style::INK,
            anchor: Anchor::Start,
        };
        canvas.text(&flight.scene.title, [28.0, 34.0], font);
        font.size = style::HEADING;
        font.color = style::SOFT_INK;
        canvas.text(&subtitle(flight), [28.0, 65.0], font);
        if free_body {
            sphere::draw(canvas, LEFT, flight);
        } else {
            space::draw(canvas, LEFT, flight);
        }
        chart::draw(canvas, RIGHT, &panels);
    })
}

/// Integrator, steps, duration; and the cost of a maneuver.
fn subtitle(flight: &FlightData) -> String {
    let scene = &flight.scene;
    let integrator = &scene.integration;
    let last = flight.last();
    let mut text = format!("{integrator}, {} steps, {} s", last.step, short(last.time));
    if let Some(cost) = flight.cost() {
        text += &format!(", cost {cost:.4}");
    }
    text
}

/// A number to about four digits.
fn short(value: f64) -> String {
    let decimals = (3.0 - libm::floor(libm::log10(value.abs().max(1e-9)))).clamp(0.0, 12.0);
    let text = format!("{value:.*}", decimals as usize);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text
    }
}
