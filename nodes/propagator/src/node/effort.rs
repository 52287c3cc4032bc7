//! Efforts of actuators from outside, torques of reaction wheels or forces of thrusters: what these do until other ones come
//! or their time is over.

use lgvi_common::header;
use lgvi_msgs::excerpt;
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::sensor_msgs::JointState;
use lgvi_msgs::stamp::{self, StampError};
use lgvi_scene::Scene;
use thiserror::Error;

use crate::node::wrench::Terms;
use crate::target::Actuators;

impl Actuators {
    /// The topic on which a body's are commanded.
    pub(crate) fn topic(self, scene: &Scene, body: usize) -> String {
        let name = &scene.bodies[body].name;
        match self {
            Self::Wheels => format!("~/wheel_torque/{name}"),
            Self::Thrusters => format!("~/thrust/{name}"),
        }
    }
}

/// Efforts of the wheels or thrusters of a body.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Efforts {
    pub(crate) body: usize,
    pub(crate) actuators: Actuators,
    /// The time in its header (ns).
    pub(crate) stamp: i64,
    /// One per actuator, in the scene's order (N m or N).
    efforts: Vec<f64>,
}

/// Why efforts are not flown.
#[derive(Clone, Debug, Error, PartialEq)]
pub(crate) enum EffortError {
    /// Bytes that are no message.
    #[error("{0}")]
    Undecodable(String),
    /// A time that is none.
    #[error("`header.stamp`: {0}")]
    Stamp(#[from] StampError),
    /// Names and efforts do not belong together.
    #[error("{names} elements in `name` and {efforts} in `effort`, expected the same number")]
    Lengths {
        /// Names in the message.
        names: usize,
        /// Efforts in it.
        efforts: usize,
    },
    /// An actuator that the body has not.
    #[error("`name` contains {found:?}, expected {kind} of the body: {}", known.join(", "))]
    Unknown {
        /// The name.
        found: String,
        /// What is commanded.
        kind: &'static str,
        /// Those of the body.
        known: Vec<String>,
    },
    /// One that is named twice.
    #[error("`name` contains {0:?} twice")]
    Twice(String),
    /// NaN or infinity.
    #[error("`effort` of {name} is {value}, expected a finite number")]
    NotFinite {
        /// The actuator.
        name: String,
        /// What it says.
        value: f64,
    },
}

impl Efforts {
    /// Checks a received message for a body of the scene. Actuators that it does not name do nothing.
    pub(crate) fn of_message(
        scene: &Scene,
        (actuators, body): (Actuators, usize),
        message: &JointState,
    ) -> Result<Self, EffortError> {
        let stamp = stamp::from_message(&message.header.stamp)?;
        let (names, efforts) = (message.name.len(), message.effort.len());
        if names != efforts {
            return Err(EffortError::Lengths { names, efforts });
        }
        let known = actuators.of(scene, body);
        let mut given = vec![None; known.len()];
        for (name, &value) in message.name.iter().zip(&message.effort) {
            let index = known.iter().position(|one| one == name);
            let index = index.ok_or_else(|| EffortError::Unknown {
                found: excerpt(name),
                kind: actuators.name(),
                known: known.to_vec(),
            })?;
            if !(value / actuators.unit(scene)).is_finite() {
                let name = name.clone();
                return Err(EffortError::NotFinite { name, value });
            }
            if given[index].replace(value).is_some() {
                return Err(EffortError::Twice(name.clone()));
            }
        }
        let efforts = given.into_iter().map(Option::unwrap_or_default);
        Ok(Self {
            body,
            actuators,
            stamp,
            efforts: efforts.collect(),
        })
    }

    /// The control sequence that they are from `first_step` on.
    ///
    /// # Errors
    /// A stamp that ROS time cannot hold.
    pub(crate) fn sequence(
        &self,
        scene: &Scene,
        terms: &Terms,
        first_step: u64,
    ) -> Result<ControlSequence, StampError> {
        let efforts = self.efforts.clone();
        let [wheel_torque, thrust] = match self.actuators {
            Actuators::Wheels => [efforts, Vec::new()],
            Actuators::Thrusters => [Vec::new(), efforts],
        };
        Ok(ControlSequence {
            header: header(scene, first_step)?,
            body: scene.bodies[self.body].name.clone(),
            first_step,
            step_size: terms.duration(scene),
            wheel_torque,
            thrust,
            ..ControlSequence::default()
        })
    }
}
