use std::fmt;

use lgvi_dynamics::{BodyError, MethodError, StepError};
use lgvi_scene::Scene;

/// The results of one sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Index of the sample.
    pub index: u64,
    /// Number of completed steps.
    pub steps: u64,
    /// The failure that ended the flight early, or `None` for a complete flight.
    pub failure: Option<Failure>,
    /// Numbers in the order of [`Campaign::columns`](crate::Campaign::columns).
    pub numbers: Vec<f64>,
}

/// The reason that a flight ended early.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The kind of failure.
    pub kind: FailureKind,
    /// A description for the user.
    pub message: String,
}

/// The kinds of failures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum FailureKind {
    /// The deviations make a body invalid, or it starts inside another one.
    Start,
    /// A body turns too far in one step.
    Turn,
    /// A state is not finite.
    NotFinite,
    /// Two bodies come too close to each other.
    CloseApproach,
    /// Two bodies dock that do not form a valid rigid body.
    Docking,
    /// Any other error of the integrator.
    Integrator,
}

impl FailureKind {
    const ALL: [Self; 6] = [
        Self::Start,
        Self::Turn,
        Self::NotFinite,
        Self::CloseApproach,
        Self::Docking,
        Self::Integrator,
    ];

    /// Returns the name of the kind in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Turn => "turn",
            Self::NotFinite => "not_finite",
            Self::CloseApproach => "close_approach",
            Self::Docking => "docking",
            Self::Integrator => "integrator",
        }
    }

    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

impl fmt::Display for FailureKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Start => "impossible start",
            Self::Turn => "turns too far in a step",
            Self::NotFinite => "not finite",
            Self::CloseApproach => "close approach",
            Self::Docking => "docking",
            Self::Integrator => "integrator",
        })
    }
}

impl Failure {
    pub(crate) fn start(error: impl ToString) -> Self {
        Self {
            kind: FailureKind::Start,
            message: error.to_string(),
        }
    }

    /// The failure of a step of the scene's bodies.
    pub(crate) fn step(scene: &Scene, error: &StepError) -> Self {
        let kind = match error {
            StepError::Unsolvable { .. } | StepError::TurnsTooFar { .. } => FailureKind::Turn,
            StepError::NotFinite { .. } => FailureKind::NotFinite,
            StepError::CloseApproach(_) => FailureKind::CloseApproach,
            StepError::Docking { .. } => FailureKind::Docking,
            _ => FailureKind::Integrator,
        };
        Self {
            kind,
            message: scene.step_error(error),
        }
    }
}

impl From<BodyError> for Failure {
    fn from(error: BodyError) -> Self {
        Self::start(error)
    }
}

impl From<MethodError> for Failure {
    fn from(error: MethodError) -> Self {
        Self::start(error)
    }
}
