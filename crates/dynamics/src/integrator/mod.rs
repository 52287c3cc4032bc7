//! Integrators, one a file.

#[cfg_attr(
    not(test),
    expect(dead_code, unused_imports, reason = "no integrator takes them yet")
)]
mod coefficients;
mod drift;
mod lgvi;
mod lie_euler;
mod turn;

use thiserror::Error;

pub use lgvi::Lgvi;
pub use lie_euler::LieEuler;

use crate::rotation::{Chart, Unsolvable};
use crate::{BodyState, Load, System};

/// A one-step method for the bodies of a [`System`].
///
/// An integrator may keep what it knows of the last states (loads, starting guesses); [`Integrator::start`] tells it
/// that the states are new.
pub trait Integrator: Send {
    /// Prepares for a trajectory from `states`.
    fn start(&mut self, system: &mut System, states: &[BodyState]);

    /// Advances `states` by one step under gravity and `controls` (one a body), constant over the step. On an error
    /// `states` are unchanged.
    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
    ) -> Result<StepReport, StepError>;
}

/// What a step took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepReport {
    /// Newton corrections of the implicit equations, most over the bodies.
    pub iterations: u32,
}

/// Why a step could not be made. Bodies count from 0.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum StepError {
    /// The body turns too far in one step.
    #[error("body {body}: {source}")]
    Unsolvable {
        /// Which body.
        body: usize,
        /// By how much.
        source: Unsolvable,
    },
    /// The step would end in NaN or infinity, as where two points of mass meet.
    #[error("body {body}: the state after the step is not finite")]
    NotFinite {
        /// Which body.
        body: usize,
    },
}

/// The integrators by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// [`Lgvi`]
    Lgvi(Chart),
    /// [`LieEuler`]
    LieEuler(Chart),
}

impl Method {
    /// The integrator with step `h` for `bodies` bodies.
    pub fn integrator(self, h: f64, bodies: usize) -> Box<dyn Integrator> {
        match self {
            Self::Lgvi(chart) => Box::new(Lgvi::new(h, chart, bodies)),
            Self::LieEuler(chart) => Box::new(LieEuler::new(h, chart, bodies)),
        }
    }
}

/// Accepts `next` as the new `states` if all are finite.
fn accept(next: &[BodyState], states: &mut [BodyState]) -> Result<(), StepError> {
    match next.iter().position(|state| !state.is_finite()) {
        Some(body) => Err(StepError::NotFinite { body }),
        None => {
            states.copy_from_slice(next);
            Ok(())
        }
    }
}
