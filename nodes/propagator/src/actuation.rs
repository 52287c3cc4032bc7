//! Commands of a body's actuators in a control sequence.

use lgvi_control::Allocation;
use lgvi_dynamics::BodyState;
use lgvi_msgs::msg::ControlSequence;
use lgvi_scene::Scene;
use thiserror::Error;

use crate::law::{ActuatorLaw, LawError};
use crate::target::Actuators;

/// The efforts of the wheels or thrusters of a body, in the scene's units.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuation {
    pub(crate) actuators: Actuators,
    /// By rows an interval.
    efforts: Vec<f64>,
    /// Actuators in a row, ≥ 1.
    count: usize,
    /// What corrects the efforts in flight; none in open loop.
    law: Option<ActuatorLaw>,
}

/// Why a sequence does not command actuators.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ActuationError {
    /// It commands more than one thing.
    #[error(
        "`{field}` has length {found} beside `{other}`, expected only one of `force`, `wheel_torque` and `thrust`"
    )]
    Both {
        /// Name of the field.
        field: &'static str,
        /// Numbers in it.
        found: usize,
        /// Name of the other field.
        other: &'static str,
    },
    /// The numbers do not fit the body's actuators.
    #[error(
        "`{field}` has length {found}, expected in each interval one for each of the {count} {kind} of {body:?}"
    )]
    Count {
        /// Name of the field.
        field: &'static str,
        /// Numbers in it.
        found: usize,
        /// Actuators of the body.
        count: usize,
        /// "wheels" or "thrusters".
        kind: &'static str,
        /// The body.
        body: String,
    },
    /// Their feedback law is invalid.
    #[error(transparent)]
    Law(#[from] LawError),
    /// A number that is NaN or infinite.
    #[error("`{field}[{index}]` is {value}, expected a finite number")]
    NotFinite {
        /// Name of the field.
        field: &'static str,
        /// Index of the number.
        index: usize,
        /// What it says.
        value: f64,
    },
}

impl Actuation {
    /// Checks the commands in a message for a body; `None` if it has none.
    pub(crate) fn check(
        scene: &Scene,
        body: usize,
        message: &ControlSequence,
    ) -> Result<Option<Self>, ActuationError> {
        let wheels = (Actuators::Wheels, &message.wheel_torque);
        let thrusters = (Actuators::Thrusters, &message.thrust);
        let (actuators, given) = match (wheels.1.is_empty(), thrusters.1.is_empty()) {
            (true, true) => return Ok(None),
            (false, _) => wheels,
            (true, false) => thrusters,
        };
        let (field, found) = (actuators.field(), given.len());
        let forces = !(message.force.is_empty() && message.moment.is_empty());
        for (other, is_given) in [
            ("force", forces),
            ("thrust", field != "thrust" && !thrusters.1.is_empty()),
        ] {
            if is_given {
                return Err(ActuationError::Both {
                    field,
                    found,
                    other,
                });
            }
        }
        let count = actuators.of(scene, body).len();
        if count == 0 || !found.is_multiple_of(count) {
            return Err(ActuationError::Count {
                field,
                found,
                count,
                kind: actuators.name(),
                body: scene.bodies[body].name.clone(),
            });
        }
        let each = given.iter().enumerate().map(|(index, &value)| {
            let effort = value / actuators.unit(scene);
            match effort.is_finite() {
                true => Ok(effort),
                false => Err(ActuationError::NotFinite {
                    field,
                    index,
                    value,
                }),
            }
        });
        let efforts = each.collect::<Result<_, _>>()?;
        let unit = actuators.unit(scene);
        let rigid = &scene.bodies[body].body;
        let allocation = || match actuators {
            Actuators::Thrusters => Allocation::of_thrusters(rigid.thrusters()?).ok(),
            Actuators::Wheels => Allocation::of_wheels(rigid.wheels()?).ok(),
        };
        let sizes = [found / count, count];
        let law = ActuatorLaw::check(message, sizes, unit, &scene.units, allocation)?;
        Ok(Some(Self {
            actuators,
            efforts,
            count,
            law,
        }))
    }

    /// Whether a law corrects the efforts in flight.
    pub(crate) fn has_law(&self) -> bool {
        self.law.is_some()
    }

    /// The same without its law.
    pub(crate) fn open_loop(self) -> Self {
        Self { law: None, ..self }
    }

    /// The memory that it takes (byte).
    pub(crate) fn size(&self) -> usize {
        let law = self.law.as_ref().map_or(0, ActuatorLaw::size);
        size_of_val(self.efforts.as_slice()) + law
    }

    /// Number of intervals.
    pub(crate) fn rows(&self) -> usize {
        self.efforts.len() / self.count
    }

    /// Writes the efforts of an interval, corrected for the body's `state` at its start; zero after the last.
    pub(crate) fn write(&self, interval: usize, state: &BodyState, efforts: &mut [f64]) {
        let first = interval.saturating_mul(self.count);
        match self.efforts.get(first..first.saturating_add(self.count)) {
            Some(row) => {
                efforts.copy_from_slice(row);
                if let Some(law) = &self.law {
                    law.correct(interval, state, efforts);
                }
            }
            None => efforts.fill(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Controls;

    fn scene() -> Scene {
        let text = r#"
            title = "A ball"
            [units]
            length = "2 m"
            [run]
            duration = 1.0
            steps = 10
            integrator = "lgvi"
            [[bodies]]
            name = "ball"
            mass = 1.0
            inertia = [1, 1, 1]
            position = [0, 0, 0]
            velocity = [0, 0, 0]
            attitude = { w = 1, x = 0, y = 0, z = 0 }
            angular_velocity = [0, 0, 0]
            [[bodies.wheels]]
            name = "wheel"
            axis = [0, 0, 1]
            inertia = 0.1
            [[bodies.thrusters]]
            name = "main"
            position = [0, 0, 0]
            direction = [1, 0, 0]
            thrust = 1
            [[bodies.thrusters]]
            name = "side"
            position = [0, 0, 0]
            direction = [0, 1, 0]
            thrust = 1
        "#;
        Scene::parse("test", text).unwrap()
    }

    fn thrust(thrust: &[f64]) -> ControlSequence {
        ControlSequence {
            body: "ball".into(),
            first_step: 3,
            step_size: 0.2,
            thrust: thrust.to_vec(),
            ..ControlSequence::default()
        }
    }

    #[test]
    fn commands_act_by_rows_in_the_units_of_the_scene() {
        let message = thrust(&[2.0, 4.0, 6.0, 8.0]);
        let controls = Controls::of_message(&scene(), &message).unwrap();
        assert_eq!(controls.end(), 7);
        let during = |step| {
            let mut efforts = [9.0; 2];
            let acts = controls.command(step, &scene().bodies[0].state, &mut efforts);
            acts.then_some(efforts)
        };
        assert_eq!(during(2), None);
        assert_eq!(during(4), Some([1.0, 2.0]));
        assert_eq!(during(5), Some([3.0, 4.0]));
        assert_eq!(during(7), Some([0.0, 0.0]));
    }

    #[test]
    fn what_does_not_command_the_actuators_is_refused_with_field_and_value() {
        let refused = |spoil: fn(&mut ControlSequence)| {
            let mut message = thrust(&[1.0, 2.0]);
            spoil(&mut message);
            let error = Controls::of_message(&scene(), &message).unwrap_err();
            error.to_string()
        };
        assert_eq!(
            refused(|m| m.thrust.truncate(1)),
            "`thrust` has length 1, expected in each interval one for each of the 2 thrusters of \"ball\""
        );
        assert_eq!(
            refused(|m| m.thrust[1] = f64::INFINITY),
            "`thrust[1]` is inf, expected a finite number"
        );
        assert_eq!(
            refused(|m| m.wheel_torque.push(1.0)),
            "`wheel_torque` has length 1 beside `thrust`, expected only one of `force`, `wheel_torque` and `thrust`"
        );
        assert_eq!(
            refused(|m| m.feedback.push(1.0)),
            "0 elements in `reference`, expected 1 for the 1 intervals of the sequence, or an open loop without `reference` and \
             `feedback`"
        );
        assert_eq!(
            refused(|m| m.thrust.clear()),
            "`force`, `moment`, `wheel_torque` and `thrust` are empty, expected at least one interval"
        );
    }
}
