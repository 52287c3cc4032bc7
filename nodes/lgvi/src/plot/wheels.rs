//! Reaction wheels over time, from the joint states in a bag.

use std::collections::BTreeMap;

use lgvi_dynamics::{BodyState, System};
use lgvi_middleware::node::NodeError;
use lgvi_msgs::sensor_msgs::JointState;
use lgvi_scene::Scene;

use super::data::FlightData;
use super::series::{Curve, Panel, over_time};
use super::style;
use lgvi_review::FlightBag;

/// Speed (rad/s) and torque (N m) of a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wheel {
    speed: f64,
    torque: f64,
}

/// The joint states in a bag: of each body with wheels, by their stamps (ns).
#[derive(Default)]
pub(super) struct WheelRecord(Vec<(usize, BTreeMap<i64, Vec<Wheel>>)>);

impl WheelRecord {
    /// Reads the joint states of a scene's bodies.
    ///
    /// # Errors
    /// A message that is not one of the scene's.
    pub(super) fn read(bag: &FlightBag) -> Result<Self, NodeError> {
        let bodies = bag.scene.bodies.iter().enumerate();
        let wheeled = bodies.filter(|(_, body)| !body.wheels.is_empty());
        let each = wheeled.map(|(index, body)| {
            let mut states = BTreeMap::new();
            let recorded = bag.of_body("joint_states", &body.name, |s: &JointState| &s.header)?;
            for (stamp, state) in recorded {
                let fits = state.name == body.wheels
                    && state.velocity.len() == state.name.len()
                    && state.effort.len() == state.name.len();
                if !fits {
                    let expected = body.wheels.join(", ");
                    let error = format!("joint states of {:?}, expected {expected}", state.name);
                    return Err(bag.refuse(&error));
                }
                let wheels = state.velocity.iter().zip(&state.effort);
                let wheels = wheels.map(|(&speed, &torque)| Wheel { speed, torque });
                states.insert(stamp, wheels.collect());
            }
            Ok((index, states))
        });
        Ok(Self(each.collect::<Result<_, _>>()?))
    }

    /// The wheels at a step, body by body, with which it sets the system; `None` if joint states are missing there.
    pub(super) fn at(
        &self,
        scene: &Scene,
        step: u64,
        states: &[BodyState],
        system: &mut System,
    ) -> Option<Vec<(usize, Vec<Wheel>)>> {
        let stamp = scene.stamp(step);
        let mut all = Vec::new();
        for (body, recorded) in &self.0 {
            let wheels = recorded.get(&stamp)?;
            let rigid = &mut system.bodies_mut()[*body];
            let rate = states[*body].angular_velocity(rigid);
            let speeds = wheels.iter().map(|wheel| wheel.speed * scene.units.time);
            let speeds: Vec<_> = speeds.collect();
            if let Some(rotors) = rigid.wheels_mut() {
                rotors.set_speeds(&speeds, &rate);
            }
            all.push((*body, wheels.clone()));
        }
        Some(all)
    }
}

/// Torques and speeds of the wheels of each body.
pub(super) fn panels(flight: &FlightData) -> Vec<Panel> {
    let units = &flight.scene.units;
    let mut panels = Vec::new();
    for (place, (body, _)) in flight.first().wheels.iter().enumerate() {
        let named = &flight.scene.bodies[*body];
        let curves = |value: fn(&Wheel) -> f64| {
            let colors = style::BODIES.iter().cycle();
            let wheels = named.wheels.iter().zip(colors).enumerate();
            let curve = wheels.map(|(index, (name, color))| Curve {
                label: name.clone(),
                color: *color,
                points: over_time(flight, |sample| value(&sample.wheels[place].1[index])),
            });
            curve.collect::<Vec<_>>()
        };
        let mut torques = Panel::new(
            format!("Torque on the wheels of {}", named.name),
            "N m",
            curves(|wheel| wheel.torque),
        );
        let mut speeds = Panel::new(
            format!("Speed of the wheels of {}", named.name),
            "rad/s",
            curves(|wheel| wheel.speed),
        );
        // Limits that all wheels have.
        let wheels = named
            .body
            .wheels()
            .map_or(&[][..], |wheels| wheels.wheels());
        if let [first, others @ ..] = wheels {
            let both = |limit: f64| limit.is_finite().then_some([limit, -limit]);
            if others
                .iter()
                .all(|other| other.max_torque == first.max_torque)
            {
                torques.limits.extend(
                    both(first.max_torque * units.energy())
                        .into_iter()
                        .flatten(),
                );
            }
            if others
                .iter()
                .all(|other| other.max_speed == first.max_speed)
            {
                speeds
                    .limits
                    .extend(both(first.max_speed / units.time).into_iter().flatten());
            }
        }
        panels.extend([torques, speeds]);
    }
    panels
}
