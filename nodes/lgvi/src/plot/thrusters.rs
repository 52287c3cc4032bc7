//! Thrusters and propellant over time, from their states in a bag.

use std::collections::BTreeMap;

use lgvi_dynamics::System;
use lgvi_middleware::node::NodeError;
use lgvi_msgs::geometry_msgs::InertiaStamped;
use lgvi_msgs::sensor_msgs::JointState;
use lgvi_scene::Scene;

use super::data::FlightData;
use super::series::{Curve, Panel, over_time};
use super::style;
use lgvi_review::FlightBag;

/// Most thrusters that are drawn one by one.
const MOST_CURVES: usize = 6;

/// What the thrusters of a body did and left.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Firing {
    body: usize,
    /// Impulse of each since the start (N s).
    impulses: Vec<f64>,
    /// The mass of the body (kg), if it has propellant.
    mass: Option<f64>,
}

impl Firing {
    /// Whether a thruster has exerted an impulse.
    pub(super) fn has_fired(&self) -> bool {
        self.impulses.iter().any(|impulse| *impulse != 0.0)
    }
}

/// The states of the thrusters of a body in a bag, by their stamps (ns).
struct Record {
    body: usize,
    impulses: BTreeMap<i64, Vec<f64>>,
    /// `None` of a body without propellant.
    mass: Option<BTreeMap<i64, f64>>,
}

/// Those of all bodies with thrusters.
#[derive(Default)]
pub(super) struct ThrusterRecord(Vec<Record>);

impl ThrusterRecord {
    /// Reads those of a scene's bodies.
    ///
    /// # Errors
    /// A message that is not one of the scene's.
    pub(super) fn read(bag: &FlightBag) -> Result<Self, NodeError> {
        let bodies = bag.scene.bodies.iter().enumerate();
        let each = bodies.filter(|(_, body)| !body.thrusters.is_empty() || body.has_engine());
        let each = each.map(|(index, body)| {
            let mut impulses = BTreeMap::new();
            let states = bag.of_body("thruster_states", &body.name, |s: &JointState| &s.header)?;
            for (stamp, state) in states {
                if state.name != body.thrusters || state.position.len() != state.name.len() {
                    let expected = body.thrusters.join(", ");
                    let error = format!("thruster states of {:?}, expected {expected}", state.name);
                    return Err(bag.refuse(&error));
                }
                impulses.insert(stamp, state.position);
            }
            let mass = match body.has_propellant() {
                true => {
                    let all =
                        bag.of_body("inertia", &body.name, |one: &InertiaStamped| &one.header)?;
                    let all = all.into_iter();
                    Some(all.map(|(stamp, one)| (stamp, one.inertia.m)).collect())
                }
                false => None,
            };
            Ok(Record {
                body: index,
                impulses,
                mass,
            })
        });
        Ok(Self(each.collect::<Result<_, _>>()?))
    }

    /// The thrusters at a step, by which it sets the masses of the system; `None` if their states are missing there.
    pub(super) fn at(&self, scene: &Scene, step: u64, system: &mut System) -> Option<Vec<Firing>> {
        let stamp = scene.stamp(step);
        let each = self.0.iter().map(|record| {
            let mass = match &record.mass {
                Some(masses) => Some(*masses.get(&stamp)?),
                None => None,
            };
            let firing = Firing {
                body: record.body,
                impulses: match scene.bodies[record.body].thrusters.is_empty() {
                    true => Vec::new(),
                    false => record.impulses.get(&stamp)?.clone(),
                },
                mass,
            };
            if let Some(mass) = mass {
                let full = &scene.bodies[record.body].body;
                let propellant = full.thrusters()?.propellant().mass;
                let left = propellant - (full.mass() - mass / scene.units.mass);
                system.bodies_mut()[record.body].set_propellant(left.clamp(0.0, propellant));
            }
            Some(firing)
        });
        each.collect()
    }
}

/// Impulses of the thrusters and mass of each body.
pub(super) fn panels(flight: &FlightData) -> Vec<Panel> {
    let mut panels = Vec::new();
    for (place, firing) in flight.first().firings.iter().enumerate() {
        let named = &flight.scene.bodies[firing.body];
        let curve = |label: &str, color, impulse: &dyn Fn(&[f64]) -> f64| Curve {
            label: label.to_owned(),
            color,
            points: over_time(flight, |sample| impulse(&sample.firings[place].impulses)),
        };
        let curves = if named.thrusters.len() > MOST_CURVES {
            let color = style::BODIES[firing.body % style::BODIES.len()];
            vec![curve("all", color, &|impulses| impulses.iter().sum())]
        } else {
            let colors = style::BODIES.iter().cycle();
            let each = named.thrusters.iter().zip(colors).enumerate();
            each.map(|(index, (name, color))| curve(name, *color, &|impulses| impulses[index]))
                .collect()
        };
        if !curves.is_empty() {
            let title = format!("Impulse of the thrusters of {}", named.name);
            panels.push(Panel::new(title, "N s", curves));
        }
        if firing.mass.is_some() {
            let curve = Curve {
                label: named.name.clone(),
                color: style::BODIES[firing.body % style::BODIES.len()],
                points: over_time(flight, |sample| {
                    sample.firings[place].mass.unwrap_or_default()
                }),
            };
            let title = format!("Mass of {}", named.name);
            panels.push(Panel::new(title, "kg", vec![curve]));
        }
    }
    panels
}
