//! The curves over time that tell how a flight went.

use lgvi_control::Place;
use lgvi_dynamics::Load;
use lgvi_lie::to_quaternion;
use lgvi_scene::Maneuver;
use nalgebra::{Vector3, Vector4};
use plotters::style::RGBColor;

use super::data::{FlightData, Sample};
use super::proximity::Proximity;
use super::subject::{Subject, heaviest, named};
use super::thin::envelope;
use super::{kept, limits, margins, style, thrusters, wheels};

/// Twice this is how many points a curve has at most.
const BUCKETS: usize = 500;

pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// Curves over the same time with the same unit.
pub(crate) struct Panel {
    pub(crate) title: String,
    /// SI, or degrees; empty where there is none.
    pub(crate) unit: &'static str,
    pub(crate) curves: Vec<Curve>,
    /// Values that must not be passed.
    pub(super) limits: Vec<f64>,
}

/// A curve: time (s) and value.
pub(crate) struct Curve {
    pub(crate) label: String,
    pub(crate) color: RGBColor,
    pub(crate) points: Vec<[f64; 2]>,
}

impl Panel {
    pub(crate) fn new(title: impl Into<String>, unit: &'static str, curves: Vec<Curve>) -> Self {
        Self {
            title: title.into(),
            unit,
            curves,
            limits: Vec::new(),
        }
    }

    /// Changes from the start, under their own title, in place of curves that are far larger than all of their changes.
    pub(super) fn or_changes(mut self, title: &str) -> Self {
        let most = |change: bool| {
            let values = self.curves.iter().flat_map(|curve| {
                let start = curve.points.first().map_or(0.0, |point| point[1]);
                let start = if change { start } else { 0.0 };
                curve
                    .points
                    .iter()
                    .map(move |point| (point[1] - start).abs())
            });
            values.fold(0.0, f64::max)
        };
        if most(true) < SMALL * most(false) {
            self.title = title.into();
            for curve in &mut self.curves {
                let start = curve.points.first().map_or(0.0, |point| point[1]);
                curve.points.iter_mut().for_each(|point| point[1] -= start);
            }
        }
        self
    }
}

/// Changes that are a smaller part than this of the values are shown alone.
const SMALL: f64 = 0.2;

/// All panels, from top to bottom: what acts, what it must keep to, what moves, and what is kept.
pub(super) fn panels(flight: &FlightData, subject: Subject) -> Vec<Panel> {
    let scene = &flight.scene;
    let controlled = !flight.controlled().is_empty();
    let gravity = !scene.gravity.is_none();
    let mut panels = Vec::new();
    if controlled {
        let force = Part {
            title: "Control force, inertial axes",
            unit: "N",
            size: scene.units.force(),
            place: Place::Position,
            of: |load| load.force,
        };
        let moment = Part {
            title: "Control moment, body axes",
            unit: "N m",
            size: scene.units.energy(),
            place: Place::Attitude,
            of: |load| load.moment,
        };
        panels.extend(control(flight, &force));
        panels.extend(control(flight, &moment));
    }
    panels.extend(wheels::panels(flight));
    panels.extend(thrusters::panels(flight));
    panels.extend(margins(flight));
    if matches!(subject, Subject::Turning | Subject::Tumbling) {
        panels.extend([attitude(flight), rates(flight)]);
    } else if let Some(near) = Proximity::of(flight) {
        panels.extend(apart(flight, &near));
    } else if let Some(relative) = relative(flight) {
        panels.extend(relative);
    } else if scene.bodies.len() > 1 {
        panels.push(distances(flight));
    } else if !controlled {
        panels.push(rates(flight));
    }
    // Alone under a fixed attractor it says no more than the error.
    if gravity && (controlled || scene.bodies.len() > 1 || scene.gravity.uniform.is_some()) {
        panels.push(kept::energies(flight));
    }
    if !controlled {
        panels.extend([kept::energy_change(flight), kept::momentum_change(flight)]);
    } else if gravity {
        let curves = components(flight, |sample| sample.angular_momentum);
        let title = "Angular momentum, inertial axes";
        panels.push(
            Panel::new(title, "kg m²/s", curves)
                .or_changes("Angular momentum change, inertial axes"),
        );
    }
    panels
}

/// The force or the moment of a load.
struct Part {
    title: &'static str,
    unit: &'static str,
    /// The scene's unit in SI.
    size: f64,
    place: Place,
    of: fn(&Load) -> Vector3<f64>,
}

/// The components for one controlled body, the magnitudes for several; nothing where there is none.
fn control(flight: &FlightData, part: &Part) -> Option<Panel> {
    let scene = &flight.scene;
    let stairs = |body: usize| -> Vec<_> {
        let stairs = flight.tracks[body].stairs(flight.last().step).into_iter();
        stairs
            .map(|(step, load)| (scene.seconds(step), (part.of)(&load) * part.size))
            .collect()
    };
    let curve = |label: &str, color, stairs: &[(f64, Vector3<f64>)], value: &Value| {
        let points = stairs.iter();
        let points = points.map(|(time, vector)| [*time, value(vector)]);
        Curve {
            label: label.into(),
            color,
            points: thin(points),
        }
    };
    let limit = limits::of_norm(flight, part.place);
    let mut limits = Vec::new();
    let curves: Vec<_> = match flight.controlled()[..] {
        [body] => {
            let stairs = stairs(body);
            let mut curves: Vec<_> = (0..3)
                .map(|i| curve(AXES[i], style::COMPONENTS[i], &stairs, &move |v| v[i]))
                .collect();
            if let Some(limit) = limit {
                curves.push(curve("magnitude", style::INK, &stairs, &|v| v.norm()));
                limits.push(limit * part.size);
            }
            for limit in limits::of_components(flight, part.place) {
                limits.extend([limit * part.size, -limit * part.size]);
            }
            curves
        }
        ref bodies => bodies
            .iter()
            .zip(style::BODIES.iter().cycle())
            .map(|(body, color)| {
                let name = &scene.bodies[*body].name;
                curve(name, *color, &stairs(*body), &|v| v.norm())
            })
            .collect(),
    };
    let mut values = curves.iter().flat_map(|curve| &curve.points);
    let soft = !limits.is_empty() && limits::is_soft(flight, part.place);
    values.any(|point| point[1] != 0.0).then(|| Panel {
        limits,
        ..Panel::new(titled(part.title, soft), part.unit, curves)
    })
}

/// A title that tells whether the limit is soft: a violation has a price.
fn titled(title: &str, is_soft: bool) -> String {
    let soft = if is_soft { ", soft limit" } else { "" };
    format!("{title}{soft}")
}

/// What is shown of a vector.
type Value = dyn Fn(&Vector3<f64>) -> f64;

/// How near the flight came to the bounds of its states.
fn margins(flight: &FlightData) -> Vec<Panel> {
    let Some(maneuver) = &flight.scene.maneuver else {
        return Vec::new();
    };
    let separation = maneuver.separation;
    let apart = separation.map(|separation| pairs(flight, maneuver, separation));
    let each = maneuver.planned().flat_map(|planned| {
        let of = match separation {
            Some(_) => format!(", {}", flight.scene.bodies[planned.body].name),
            None => String::new(),
        };
        margins_of(flight, planned, &of)
    });
    apart.into_iter().chain(each).collect()
}

/// The distances between bodies that are planned together.
fn pairs(flight: &FlightData, maneuver: &Maneuver, separation: f64) -> Panel {
    let planned: Vec<_> = maneuver.planned().map(|planned| planned.body).collect();
    let pairs = (0..planned.len()).flat_map(|one| (0..one).map(move |other| [other, one]));
    let curves = pairs
        .zip(style::BODIES.iter().cycle())
        .map(|(pair, color)| {
            let bodies = pair.map(|place| planned[place]);
            let [one, other] = bodies.map(|body| &flight.scene.bodies[body].name);
            Curve {
                label: format!("{one}, {other}"),
                color: *color,
                points: over_time(flight, |sample| {
                    let [one, other] = bodies.map(|body| sample.bodies[body].position);
                    (one - other).norm()
                }),
            }
        });
    Panel {
        limits: vec![separation * flight.scene.units.length],
        ..Panel::new("Distance between planned bodies", "m", curves.collect())
    }
}

/// The margins of one planned body, with this end of their titles.
fn margins_of(flight: &FlightData, planned: &Maneuver, of: &str) -> Vec<Panel> {
    let each = margins::margins(flight, planned).map(|margin| {
        let times = flight.samples.iter().map(|sample| sample.time);
        let points = times.zip(&margin.values);
        let curve = plain(thin(points.map(|(time, value)| [time, *value])));
        Panel {
            limits: vec![margin.bound],
            ..Panel::new(
                titled(&format!("{}{of}", margin.title), margin.is_soft),
                margin.unit,
                vec![curve],
            )
        }
    });
    each.collect()
}

/// The body that is turned: that of the maneuver, or the only one.
pub(super) fn turned(flight: &FlightData) -> usize {
    let maneuver = flight.scene.maneuver.as_ref();
    maneuver.map_or(0, |maneuver| maneuver.body)
}

/// The quaternion, of the two signs always the one nearer to that before.
fn attitude(flight: &FlightData) -> Panel {
    let body = turned(flight);
    let mut before = Vector4::new(1.0, 0.0, 0.0, 0.0);
    let quaternions = flight.samples.iter().map(|sample| {
        let matrix = sample.bodies[body].attitude;
        let (w, v) = to_quaternion(&matrix);
        let quaternion = Vector4::new(w, v.x, v.y, v.z);
        before = if quaternion.dot(&before) < 0.0 {
            -quaternion
        } else {
            quaternion
        };
        (sample.time, before)
    });
    let quaternions: Vec<_> = quaternions.collect();
    let [x, y, z] = style::COMPONENTS;
    let parts = [("w", style::INK), ("x", x), ("y", y), ("z", z)];
    let curves = (0..).zip(parts).map(|(i, (label, color))| {
        let points = quaternions.iter().map(|(time, q)| [*time, q[i]]);
        Curve {
            label: label.into(),
            color,
            points: thin(points),
        }
    });
    Panel::new("Attitude quaternion", "", curves.collect())
}

fn rates(flight: &FlightData) -> Panel {
    let body = turned(flight);
    let curves = components(flight, |sample| sample.bodies[body].rate);
    Panel::new("Body rates, body axes", "rad/s", curves)
}

/// Position and velocity relative to the port that a corridor leads to, in its axes.
fn relative(flight: &FlightData) -> Option<[Panel; 2]> {
    let port = limits::port(flight)?;
    let body = turned(flight);
    let origin = port.position * flight.scene.units.length;
    let position = components(flight, |sample| {
        port.attitude
            .tr_mul(&(sample.bodies[body].position - origin))
    });
    let velocity = components(flight, |sample| {
        port.attitude.tr_mul(&sample.bodies[body].velocity)
    });
    let title = |what: &str| format!("{what} in the frame of {}", port.name);
    Some([
        Panel::new(title("Position"), "m", position),
        Panel::new(title("Velocity"), "m/s", velocity),
    ])
}

/// Where the others are, seen from the body that they are near to: by component if there is one other.
fn apart(flight: &FlightData, near: &Proximity) -> Vec<Panel> {
    let bodies = &flight.scene.bodies;
    let mut panels = vec![distances(flight)];
    if let [_, _] = bodies.as_slice() {
        let other = 1 - near.body;
        let curves = (0..3).map(|i| {
            let points = (0..).zip(&flight.samples).map(|(k, sample)| {
                let place = near.position(k, &sample.bodies[other].position);
                [sample.time, place[i]]
            });
            Curve {
                label: AXES[i].into(),
                color: style::COMPONENTS[i],
                points: thin(points),
            }
        });
        let title = format!(
            "Position of {}, seen from {}",
            bodies[other].name, bodies[near.body].name
        );
        panels.insert(0, Panel::new(title, "m", curves.collect()));
    }
    panels
}

/// Between the two bodies, or of the named bodies from the heaviest.
fn distances(flight: &FlightData) -> Panel {
    let bodies = &flight.scene.bodies;
    let from = heaviest(flight);
    let curves: Vec<_> = (named(flight).into_iter().zip(style::BODIES))
        .filter(|(body, _)| *body != from)
        .map(|(body, color)| Curve {
            label: bodies[body].name.clone(),
            color,
            points: over_time(flight, |sample| {
                (sample.bodies[body].position - sample.bodies[from].position).norm()
            }),
        })
        .collect();
    let title = format!("Distance from {}", bodies[from].name);
    Panel::new(title, "m", curves)
}

/// The only curve of its panel, which needs no label.
pub(super) fn plain(points: Vec<[f64; 2]>) -> Curve {
    Curve {
        label: String::new(),
        color: style::INK,
        points,
    }
}

fn components(flight: &FlightData, vector: impl Fn(&Sample) -> Vector3<f64>) -> Vec<Curve> {
    (0..3)
        .map(|i| Curve {
            label: AXES[i].into(),
            color: style::COMPONENTS[i],
            points: over_time(flight, |sample| vector(sample)[i]),
        })
        .collect()
}

pub(super) fn over_time(flight: &FlightData, value: impl Fn(&Sample) -> f64) -> Vec<[f64; 2]> {
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
