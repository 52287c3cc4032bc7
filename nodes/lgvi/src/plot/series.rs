//! The curves over time that tell how a flight went.

use lgvi_dynamics::Load;
use nalgebra::Vector3;
use plotters::style::RGBColor;

use super::data::{FlightData, Sample};
use super::style;
use super::thin::envelope;

/// Twice this is how many points a curve has at most.
const BUCKETS: usize = 500;

/// Curves over the same time with the same unit.
pub(super) struct Panel {
    pub(super) title: &'static str,
    /// SI; empty where there is none.
    pub(super) unit: &'static str,
    pub(super) curves: Vec<Curve>,
}

/// A curve: time (s) and value.
pub(super) struct Curve {
    pub(super) label: String,
    pub(super) color: RGBColor,
    pub(super) points: Vec<[f64; 2]>,
}

/// All panels, from top to bottom. What controls change is shown itself; what is to stay is shown by its error.
pub(super) fn panels(flight: &FlightData, free_body: bool) -> Vec<Panel> {
    let mut panels = Vec::new();
    let controlled = !flight.controlled().is_empty();
    if controlled {
        let (force, moment): (Part, Part) = (|load| load.force, |load| load.moment);
        panels.push(control(flight, "Control force, inertial axes", "N", force));
        panels.push(control(flight, "Control moment, body axes", "N m", moment));
    }
    if free_body {
        let curves = components(["x", "y", "z"], |sample| sample.bodies[0].spin, flight);
        panels.push(Panel {
            title: "Angular momentum Π, body axes",
            unit: "kg m²/s",
            curves,
        });
    } else {
        panels.push(energy(flight));
    }
    if controlled {
        let curves = components(["x", "y", "z"], |sample| sample.angular_momentum, flight);
        panels.push(Panel {
            title: "Angular momentum",
            unit: "kg m²/s",
            curves,
        });
    } else {
        panels.push(energy_error(flight));
        panels.push(momentum_error(flight));
    }
    panels
}

/// Force or moment.
type Part = fn(&Load) -> Vector3<f64>;

/// The components for one controlled body, the magnitudes for several.
fn control(flight: &FlightData, title: &'static str, unit: &'static str, part: Part) -> Panel {
    let scene = &flight.scene;
    let stairs = |body: usize| {
        let stairs = flight.tracks[body].stairs(flight.last().step).into_iter();
        stairs.map(|(step, load)| (scene.seconds(step), part(&scene.units.load_to_si(&load))))
    };
    let curves = match flight.controlled()[..] {
        [body] => (0..3)
            .map(|i| Curve {
                label: ["x", "y", "z"][i].into(),
                color: style::COMPONENTS[i],
                points: thin(stairs(body).map(|(time, vector)| [time, vector[i]])),
            })
            .collect(),
        ref bodies => bodies
            .iter()
            .map(|body| Curve {
                label: scene.bodies[*body].name.clone(),
                color: style::BODIES[body % style::BODIES.len()],
                points: thin(stairs(*body).map(|(time, vector)| [time, vector.norm()])),
            })
            .collect(),
    };
    Panel {
        title,
        unit,
        curves,
    }
}

fn energy(flight: &FlightData) -> Panel {
    let curve = |label: &str, color, value: fn(&Sample) -> f64| Curve {
        label: label.into(),
        color,
        points: over_time(flight, value),
    };
    let mut curves = vec![
        curve("translation", style::BLUE, |sample| {
            sample.energy.translation
        }),
        curve("rotation", style::VERMILION, |sample| {
            sample.energy.rotation
        }),
    ];
    if !flight.scene.gravity.is_none() {
        curves.push(curve("potential", style::GREEN, |sample| {
            sample.energy.potential
        }));
    }
    curves.push(curve("total", style::INK, |sample| sample.energy.total));
    Panel {
        title: "Energy",
        unit: "J",
        curves,
    }
}

fn energy_error(flight: &FlightData) -> Panel {
    let start = flight.first().energy.total;
    let (title, unit, scale) = if start == 0.0 {
        ("Energy error E − E₀", "J", 1.0)
    } else {
        ("Relative energy error (E − E₀) / |E₀|", "", start.abs())
    };
    let points = over_time(flight, |sample| (sample.energy.total - start) / scale);
    Panel {
        title,
        unit,
        curves: vec![plain(points)],
    }
}

fn momentum_error(flight: &FlightData) -> Panel {
    let start = flight.first().angular_momentum;
    let (title, unit, scale) = if start == Vector3::zeros() {
        ("Angular momentum error |L − L₀|", "kg m²/s", 1.0)
    } else {
        (
            "Relative angular momentum error |L − L₀| / |L₀|",
            "",
            start.norm(),
        )
    };
    let points = over_time(flight, |sample| {
        (sample.angular_momentum - start).norm() / scale
    });
    Panel {
        title,
        unit,
        curves: vec![plain(points)],
    }
}

/// The only curve of its panel, which needs no label.
fn plain(points: Vec<[f64; 2]>) -> Curve {
    Curve {
        label: String::new(),
        color: style::INK,
        points,
    }
}

fn components(
    labels: [&str; 3],
    vector: impl Fn(&Sample) -> Vector3<f64>,
    flight: &FlightData,
) -> Vec<Curve> {
    (0..3)
        .map(|i| Curve {
            label: labels[i].into(),
            color: style::COMPONENTS[i],
            points: over_time(flight, |sample| vector(sample)[i]),
        })
        .collect()
}

fn over_time(flight: &FlightData, value: impl Fn(&Sample) -> f64) -> Vec<[f64; 2]> {
    thin(
        flight
            .samples
            .iter()
            .map(|sample| [sample.time, value(sample)]),
    )
}

fn thin(points: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    envelope(points.collect(), BUCKETS)
}
