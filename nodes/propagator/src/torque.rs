//! Torques for reaction wheels from outside: what their motors do until other ones come or their time is over.

use lgvi_common::header;
use lgvi_msgs::excerpt;
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::sensor_msgs::JointState;
use lgvi_msgs::stamp::{self, StampError};
use lgvi_scene::Scene;
use thiserror::Error;

use crate::wrench::Terms;

/// Torques for the wheels of a body.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WheelTorques {
    pub(crate) body: usize,
    /// The time in its header (ns).
    pub(crate) stamp: i64,
    /// One per wheel, in the scene's order (N m).
    torques: Vec<f64>,
}

/// Why torques are not flown.
#[derive(Clone, Debug, Error, PartialEq)]
pub(crate) enum TorqueError {
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
    /// A wheel that the body has not.
    #[error("`name` contains {found:?}, expected wheels of the body: {}", known.join(", "))]
    Unknown {
        /// The name.
        found: String,
        /// The wheels of the body.
        known: Vec<String>,
    },
    /// A wheel that is named twice.
    #[error("`name` contains {0:?} twice")]
    Twice(String),
    /// NaN or infinity.
    #[error("`effort` of {wheel} is {value}, expected a finite number")]
    NotFinite {
        /// The wheel.
        wheel: String,
        /// What it says.
        value: f64,
    },
}

impl WheelTorques {
    /// Checks a received message for a body of the scene. Wheels that it does not name get no torque.
    pub(crate) fn of_message(
        scene: &Scene,
        body: usize,
        message: &JointState,
    ) -> Result<Self, TorqueError> {
        let stamp = stamp::from_message(&message.header.stamp)?;
        let (names, efforts) = (message.name.len(), message.effort.len());
        if names != efforts {
            return Err(TorqueError::Lengths { names, efforts });
        }
        let known = &scene.bodies[body].wheels;
        let mut torques = vec![None; known.len()];
        for (name, &value) in message.name.iter().zip(&message.effort) {
            let index = known.iter().position(|wheel| wheel == name);
            let index = index.ok_or_else(|| TorqueError::Unknown {
                found: excerpt(name),
                known: known.clone(),
            })?;
            if !(value / scene.units.energy()).is_finite() {
                let wheel = name.clone();
                return Err(TorqueError::NotFinite { wheel, value });
            }
            if torques[index].replace(value).is_some() {
                return Err(TorqueError::Twice(name.clone()));
            }
        }
        let torques = torques.into_iter().map(Option::unwrap_or_default);
        Ok(Self {
            body,
            stamp,
            torques: torques.collect(),
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
        Ok(ControlSequence {
            header: header(scene, first_step)?,
            body: scene.bodies[self.body].name.clone(),
            first_step,
            step_size: terms.duration(scene),
            feedback: self.torques.clone(),
            ..ControlSequence::default()
        })
    }
}
