//! What a result is to be read with.

use std::fmt::{Display, Formatter, Result};

use serde::{Deserialize, Serialize};

/// Something that a user has to know of a scene, a plan or a flight, though nothing has failed.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq, Serialize)]
pub struct Warning {
    /// What it is about, for programs.
    pub code: WarningCode,
    /// A plain sentence with the values, for people; without a full stop.
    pub message: String,
}

/// What a [`Warning`] is about. The names are part of the interface.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum WarningCode {
    /// A body turns too far in a step.
    LongTurn,
    /// A step is a great part of an orbit.
    LongStep,
    /// The energy of a flight without controls has changed by more than sound steps let it.
    ChangedEnergy,
    /// The maneuver's steps lead farther from the continuous motion than `auto` was asked for.
    CoarseSteps,
    /// A step of the trial cannot be made.
    TrialStep,
    /// An automatic integrator's tolerance may not be met, or its end is not known.
    Accuracy,
    /// The maneuver is flown by other steps than it is planned in.
    FlownOtherwise,
    /// A plan is not known to be a local minimum.
    NotMinimum,
    /// A body has used all its propellant.
    NoPropellant,
}

impl Warning {
    /// With its sentence.
    pub fn new(code: WarningCode, message: impl Into<String>) -> Self {
        let message = message.into();
        Self { code, message }
    }

    /// Logs it and tells it to the supervisor, if there is one.
    #[cfg(feature = "node")]
    pub fn tell(self, events: &lgvi_middleware::report::Reporter) {
        tracing::warn!("{}", self.message);
        events.report(crate::Event::Warned(self));
    }
}

impl Display for Warning {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(&self.message)
    }
}
