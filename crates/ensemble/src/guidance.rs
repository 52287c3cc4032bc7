use lgvi_dynamics::{BodyState, Load};

/// Commands to the maneuvered body.
pub enum Guidance {
    /// None: the scene has no maneuver.
    None,
    /// A plan of force and moment flown without correction: one load per step from step 0 on.
    OpenLoop(Vec<Load>),
    /// A plan whose commands each sample is asked for at each step.
    StepByStep(Box<dyn Commands>),
}

/// What is commanded during a step, as to actuators without errors.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Force (inertial frame) and moment (body frame).
    Load(Load),
    /// The forces of the thrusters, or the torques of the wheels, that the maneuver commands, one for each.
    Efforts(Vec<f64>),
}

/// Commands step by step.
pub trait Commands: Send + Sync {
    /// Returns the number of steps until the plan arrives.
    fn steps(&self) -> u64;

    /// Returns true if the commands depend on the state.
    fn have_feedback(&self) -> bool;

    /// Returns the command during `step` to the body, which is in `state` at the start of the step. Where its mass or inertia
    /// deviates, momenta are those of the nominal body at the velocities.
    fn at(&self, step: u64, state: &BodyState) -> Command;
}

impl Guidance {
    /// Returns the number of steps until the plan arrives, or `None` without a plan.
    pub(crate) fn steps(&self) -> Option<u64> {
        match self {
            Self::None => None,
            Self::OpenLoop(loads) => Some(loads.len() as u64),
            Self::StepByStep(commands) => Some(commands.steps()),
        }
    }

    /// Returns the name of the guidance.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::None => "none",
            Self::StepByStep(commands) if commands.have_feedback() => "feedback",
            Self::OpenLoop(_) | Self::StepByStep(_) => "open loop",
        }
    }

    pub(crate) fn at(&self, step: u64, state: &BodyState) -> Option<Command> {
        match self {
            Self::None => None,
            Self::OpenLoop(loads) => {
                let load = loads.get(usize::try_from(step).ok()?);
                Some(Command::Load(load.copied().unwrap_or_default()))
            }
            Self::StepByStep(commands) => Some(commands.at(step, state)),
        }
    }
}
