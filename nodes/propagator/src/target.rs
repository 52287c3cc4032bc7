//! What controls act on.

use lgvi_scene::{Commands, Scene};

/// What a sequence or a command acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// The body of an index.
    Body(usize),
    /// The wheels or the thrusters of a body.
    Actuators(Actuators, usize),
}

impl Target {
    /// The number of targets of so many bodies, more than any index.
    pub(crate) fn count(bodies: usize) -> usize {
        3 * bodies
    }

    /// All targets of so many bodies have different indices.
    pub(crate) fn index(self, bodies: usize) -> usize {
        match self {
            Self::Body(body) => body,
            Self::Actuators(Actuators::Wheels, body) => bodies + body,
            Self::Actuators(Actuators::Thrusters, body) => 2 * bodies + body,
        }
    }
}

/// The actuators of a body that are commanded together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Actuators {
    /// Its reaction wheels, by torques.
    Wheels,
    /// Its thrusters, by forces.
    Thrusters,
}

impl Actuators {
    /// Those that a maneuver with these commands commands.
    pub(crate) fn commanded(commands: Commands) -> Option<Self> {
        match commands {
            Commands::Loads => None,
            Commands::Thrusters => Some(Self::Thrusters),
            Commands::Wheels => Some(Self::Wheels),
        }
    }

    /// Their names, in the scene's order.
    pub(crate) fn of(self, scene: &Scene, body: usize) -> &[String] {
        let named = &scene.bodies[body];
        match self {
            Self::Wheels => &named.wheels,
            Self::Thrusters => &named.thrusters,
        }
    }

    /// The unit of their efforts in SI.
    pub(crate) fn unit(self, scene: &Scene) -> f64 {
        match self {
            Self::Wheels => scene.units.energy(),
            Self::Thrusters => scene.units.force(),
        }
    }

    /// The field of a control sequence that commands them.
    pub(crate) fn field(self) -> &'static str {
        match self {
            Self::Wheels => "wheel_torque",
            Self::Thrusters => "thrust",
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Wheels => "wheels",
            Self::Thrusters => "thrusters",
        }
    }
}
