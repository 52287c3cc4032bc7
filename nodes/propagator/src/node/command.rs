//! What a controller from outside sends: wrenches on bodies, and efforts of their wheels and thrusters.

use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::stamp::StampError;
use lgvi_scene::Scene;

use super::effort::Efforts;
use crate::node::wrench::{Terms, Wrench};
use crate::target::Target;

/// A command that acts until another one for the same target comes, or its time is over.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Command {
    /// A force and a moment.
    Wrench(Wrench),
    /// Torques of wheels, or forces of thrusters.
    Efforts(Efforts),
}

impl Command {
    pub(crate) fn target(&self) -> Target {
        match self {
            Self::Wrench(wrench) => Target::Body(wrench.body),
            Self::Efforts(efforts) => Target::Actuators(efforts.actuators, efforts.body),
        }
    }

    /// The time in its header (ns).
    pub(crate) fn stamp(&self) -> i64 {
        match self {
            Self::Wrench(wrench) => wrench.stamp,
            Self::Efforts(efforts) => efforts.stamp,
        }
    }

    /// The control sequence that it is from `first_step` on.
    ///
    /// # Errors
    /// A stamp that ROS time cannot hold.
    pub(crate) fn sequence(
        &self,
        scene: &Scene,
        terms: &Terms,
        first_step: u64,
    ) -> Result<ControlSequence, StampError> {
        match self {
            Self::Wrench(wrench) => wrench.sequence(scene, terms, first_step),
            Self::Efforts(efforts) => efforts.sequence(scene, terms, first_step),
        }
    }
}

impl Target {
    /// What the log calls a command for it.
    pub(crate) fn describe(self, scene: &Scene) -> String {
        match self {
            Self::Body(body) => format!("wrench on {}", scene.bodies[body].name),
            Self::Actuators(actuators, body) => {
                format!(
                    "command for the {} of {}",
                    actuators.name(),
                    scene.bodies[body].name
                )
            }
        }
    }
}
