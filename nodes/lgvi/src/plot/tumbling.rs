//! A body that tumbles freely: the path of its angular momentum on the sphere of constant `|Π|` in the body frame. It stays
//! on one of the curves of constant energy, the polhodes.

use nalgebra::Vector3;
use plotters::style::RGBColor;

use super::canvas::{Canvas, Stroke};
use super::chart::Rectangle;
use super::data::FlightData;
use super::globe::{self, Content};
use super::legend::{Entry, Mark};
use super::marks::{end, start};
use super::polhode::Polhodes;
use super::style;
use super::thin::even;
use super::view::Camera;

/// Points of the path.
const POINTS: usize = 6000;

const FLOWN: RGBColor = style::BODIES[0];

/// Draws into `space`.
pub(super) fn draw(canvas: &mut Canvas<'_>, space: Rectangle, flight: &FlightData) {
    let length = flight.first().bodies[0].spin.norm();
    let path: Vec<_> = even(flight.samples.len(), POINTS)
        .into_iter()
        .map(|k| flight.samples[k].bodies[0].spin / length)
        .collect();
    let polhodes = Polhodes::new(flight.scene.bodies[0].body.inertia().matrix());
    let separatrix = polhodes.separatrix();
    let flown = Stroke::new(FLOWN, 3.0);
    let level = Stroke::new(RGBColor(150, 150, 150), 1.1);
    let parting = Stroke::new(style::TARGET, 1.8);

    let mut legend = vec![
        Entry::new(Mark::Line(flown), "as flown"),
        Entry::new(Mark::Line(level), "constant energy"),
    ];
    if !separatrix.is_empty() {
        legend.push(Entry::new(Mark::Line(parting), "separatrix"));
    }
    legend.push(Entry::new(Mark::Start(FLOWN), "start"));
    legend.push(Entry::new(Mark::End(FLOWN), "end"));
    legend.push(Entry::new(Mark::None, "J: moment of inertia"));
    let levels = polhodes.curves().into_iter().map(|curve| (curve, level));
    let parting = separatrix.into_iter().map(|curve| (curve, parting));
    let [first, last] = [path[0], path[path.len() - 1]];
    let camera = camera(&path, &polhodes.axes());
    let content = Content {
        legend,
        axes: polhodes.axes(),
        names: ["least J", "middle J", "greatest J"],
        caps: Vec::new(),
        curves: levels.chain(parting).chain([(path, flown)]).collect(),
    };
    let globe = globe::draw(canvas, space, camera, &content);
    start(canvas, globe.place(&first), FLOWN);
    end(canvas, globe.place(&last), FLOWN);
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
