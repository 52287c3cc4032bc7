//! What a controller from outside sends: wrenches on bodies, and torques for their wheels.

use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::stamp::StampError;
use lgvi_scene::Scene;

use crate::Controls;
use crate::torque::WheelTorques;
use crate::wrench::{Terms, Wrench};

/// A command that acts until another one for the same target comes, or its time is over.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Command {
    /// A force and a moment.
    Wrench(Wrench),
    /// Torques of the wheels' motors.
    Wheels(WheelTorques),
}

/// What a command acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// The body of an index.
    Body(usize),
    /// The wheels of a body.
    Wheels(usize),
}

impl Target {
    /// That of a control sequence.
    pub(crate) fn of(controls: &Controls) -> Self {
        match controls.loads.is_empty() {
            true => Self::Wheels(controls.body),
            false => Self::Body(controls.body),
        }
    }

    /// All targets of a scene have different indices, below twice the number of its bodies.
    pub(crate) fn index(self, scene: &Scene) -> usize {
        match self {
            Self::Body(body) => body,
            Self::Wheels(body) => scene.bodies.len() + body,
        }
    }

    /// What the log calls a command for it.
    pub(crate) fn describe(self, scene: &Scene) -> String {
        match self {
            Self::Body(body) => format!("wrench on {}", scene.bodies[body].name),
            Self::Wheels(body) => format!("torque for the wheels of {}", scene.bodies[body].name),
        }
    }
}

impl Command {
    pub(crate) fn target(&self) -> Target {
        match self {
            Self::Wrench(wrench) => Target::Body(wrench.body),
            Self::Wheels(torques) => Target::Wheels(torques.body),
        }
    }

    /// The time in its header (ns).
    pub(crate) fn stamp(&self) -> i64 {
        match self {
            Self::Wrench(wrench) => wrench.stamp,
            Self::Wheels(torques) => torques.stamp,
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
            Self::Wheels(torques) => torques.sequence(scene, terms, first_step),
        }
    }
}
