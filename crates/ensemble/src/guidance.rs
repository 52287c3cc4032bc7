use lgvi_dynamics::{BodyState, Load};

/// Loads on the maneuvered body, as commanded to its nominal actuators.
pub enum Guidance {
    /// None: the scene has no maneuver.
    None,
    /// A plan flown without correction: one load per step from step 0 on.
    OpenLoop(Vec<Load>),
    /// A plan corrected by its feedback law.
    Feedback(Box<dyn Commands>),
}

/// Commands that depend on the state.
pub trait Commands: Send + Sync {
    /// Returns the number of steps until the plan arrives.
    fn steps(&self) -> u64;

    /// Returns the load during `step` on the body, which is in `state` at the start of the step.
    fn at(&self, step: u64, state: &BodyState) -> Load;
}

impl Guidance {
    /// Returns the number of steps until the plan arrives, or `None` without a plan.
    pub(crate) fn steps(&self) -> Option<u64> {
        match self {
            Self::None => None,
            Self::OpenLoop(loads) => Some(loads.len() as u64),
            Self::Feedback(commands) => Some(commands.steps()),
        }
    }

    /// Returns the name of the guidance.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::None => "none",
            Self::OpenLoop(_) => "open loop",
            Self::Feedback(_) => "feedback",
        }
    }

    pub(crate) fn at(&self, step: u64, state: &BodyState) -> Option<Load> {
        match self {
            Self::None => None,
            Self::OpenLoop(loads) => {
                let load = loads.get(usize::try_from(step).ok()?);
                Some(load.copied().unwrap_or_default())
            }
            Self::Feedback(commands) => Some(commands.at(step, state)),
        }
    }
}
