use lgvi_dynamics::{BodyState, Load};

/// What acts on the maneuverd body, for its nominal actuators.
pub enum Guidance {
    /// Nothing: the scene has no maneuver.
    None,
    /// A plan, whatever comes of it: one load a step from step 0 on.
    OpenLoop(Vec<Load>),
    /// A plan corrected by its feedback law.
    Feedback(Box<dyn Commands>),
}

/// Commands that answer to the state.
pub trait Commands: Send + Sync {
    /// Steps until the plan arrives.
    fn steps(&self) -> u64;

    /// The load during `step` on the body that is in `state` at its start.
    fn at(&self, step: u64, state: &BodyState) -> Load;
}

impl Guidance {
    /// Steps until the plan arrives; `None` without one.
    pub(crate) fn steps(&self) -> Option<u64> {
        match self {
            Self::None => None,
            Self::OpenLoop(loads) => Some(loads.len() as u64),
            Self::Feedback(commands) => Some(commands.steps()),
        }
    }

    /// What it is called.
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
