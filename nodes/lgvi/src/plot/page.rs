//! The whole picture: title, motion on the left, curves over time on the right.

use lgvi_middleware::node::NodeError;
use plotters::style::Color;

use super::canvas::{Anchor, Canvas, Font, picture, text_width};
use super::chart::{self, Rectangle, time_unit};
use super::data::FlightData;
use super::proximity::Proximity;
use super::subject::Subject;
use super::{pointing, proximity, series, space, style, tumbling};

/// Width, and height with as many panels as fit it and for each further one (px).
const WIDTH: f64 = 1120.0;
const HEIGHT: f64 = 760.0;
const PANELS: usize = 4;
const PANEL: f64 = 175.0;

/// Ends of the motion and of the curves from the left, and where they begin from the top (px).
const MOTION: [f64; 2] = [24.0, 660.0];
const CURVES: [f64; 2] = [676.0, 1098.0];
const TOP: f64 = 84.0;

/// The picture of a flight, as an SVG document.
pub(super) fn draw(flight: &FlightData) -> Result<String, NodeError> {
    let subject = Subject::of(flight);
    let panels = series::panels(flight, subject);
    let height = HEIGHT + PANEL * panels.len().saturating_sub(PANELS) as f64;
    let size = [WIDTH as u32, height as u32];
    let between = |[left, right]: [f64; 2], top| Rectangle {
        from: [left, top],
        to: [right, height - 8.0],
    };
    let near = Proximity::of(flight).map_or_else(String::new, |near| near.title(flight));
    picture(size, &flight.scene.title, |canvas| {
        let corners = [[0.0, 0.0], [WIDTH, 0.0], [WIDTH, height], [0.0, height]];
        canvas.area(&corners, style::PAPER.to_rgba());
        let [left, right] = MOTION;
        let width = text_width(&flight.scene.title, style::TITLE);
        let mut font = Font {
            size: style::TITLE * ((right - left) / width).min(1.0),
            color: style::INK,
            anchor: Anchor::Start,
        };
        canvas.text(&flight.scene.title, [left, 26.0], font);
        font.size = style::HEADING;
        font.color = style::SOFT_INK;
        canvas.text(&subtitle(flight), [left, 50.0], font);
        font.color = style::INK;
        let (draw, seen): (Draw, &str) = match subject {
            Subject::Tumbling => (
                tumbling::draw,
                "Direction of the angular momentum in the body",
            ),
            Subject::Turning => (
                pointing::draw,
                "Directions of the body's axes in the inertial frame",
            ),
            Subject::Near => (proximity::draw, &near),
            Subject::Moving => (space::draw, "Motion in the inertial frame"),
        };
        canvas.text(seen, [left, 72.0], font);
        draw(canvas, between(MOTION, TOP), flight);
        chart::draw(canvas, between(CURVES, 10.0), &panels);
    })
}

type Draw = fn(&mut Canvas<'_>, Rectangle, &FlightData);

/// Integrator, steps, duration; and the cost of a maneuver.
fn subtitle(flight: &FlightData) -> String {
    let scene = &flight.scene;
    let integrator = &scene.integration;
    let last = flight.last();
    let (unit, symbol) = time_unit(last.time);
    let duration = short(last.time / unit);
    let mut text = format!("{integrator}, {} steps, {duration} {symbol}", last.step);
    if let Some((kind, cost)) = flight.cost() {
        text += &format!(", {kind} {cost:.4}");
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
