use thiserror::Error;

use super::response::Response;
use super::{Levels, Skip};
use crate::gravity::Neglect;
use crate::{Accuracy, BodyState, StepError, System};

/// Limit of gravity evaluations in the flights that measure the growth of errors, and limit of their cost in multiples
/// of a point in a central field.
const EVALUATIONS: u64 = 60_000;
const COST: f64 = 5e7;

/// The allowed neglected part of every body's acceleration.
///
/// If at most `b` is neglected throughout, in sizes of the scene and in rad per time squared, the error of the state at
/// the end of a run of duration T is at most `∫ κ (T − t) b dt = ½ κ T² b`, as measured by [`Accuracy`]. Here `κ`, the
/// growth of a change of velocity, is measured in flights of the whole run. So `b = 2 ε/(κ T²)` for a tolerance ε.
///
/// # Assumptions and limitations
/// The neglected acceleration is strictly bounded. Its effect is only as certain as the measured κ, which is doubled as
/// a margin. The flights have no controls and start from the given states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowance {
    /// Tolerance of the error.
    pub tolerance: f64,
    /// `b`.
    pub perturbation: f64,
    /// Size of the scene.
    pub length: f64,
    /// `κ`.
    pub response: f64,
    /// Gravity evaluations used for the measurement.
    pub evaluations: u64,
}

/// Reasons why a tolerance does not permit omissions.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// Nothing would be negligible in the initial states.
    #[error("nothing would be negligible at the start, even if errors grew as in free motion")]
    Nothing,
    /// The flights did not cover the whole run.
    #[error(
        "how errors grow is not known: flights of the whole run take more than {evaluations} evaluations of gravity"
    )]
    Costly {
        /// Limit of gravity evaluations for a flight.
        evaluations: u64,
    },
    /// The motion cannot be integrated.
    #[error("how errors grow is not known: a flight fails: {0}")]
    Flight(StepError),
    /// The flights diverge too far from each other.
    #[error("errors grow too fast: a change of velocity by a millionth makes {error:.1e}")]
    Saturated {
        /// The error.
        error: f64,
    },
    /// Nothing may be omitted at the distances that occur in the run.
    #[error(
        "errors grow {response:.1} times as in free motion, too fast for anything to be negligible in the run"
    )]
    Never {
        /// `κ`.
        response: f64,
    },
}

impl Allowance {
    /// Computes the allowance for a run of `duration` from `states` (one per body), such that the error at its end is
    /// `tolerance`, as measured by [`Accuracy`], if errors grow as κ predicts.
    pub fn new(
        system: &mut System,
        states: &[BodyState],
        duration: f64,
        tolerance: f64,
    ) -> Result<Self, Refusal> {
        let Accuracy { length } = Accuracy::new(system.bodies(), states);
        let with = |response: Response| Self {
            tolerance,
            perturbation: 2.0 * tolerance / (response.factor * duration * duration),
            length,
            response: response.factor,
            evaluations: response.evaluations,
        };
        let at_best = with(Response {
            factor: 1.0,
            evaluations: 0,
        });
        let mut levels = |allowance| Levels::new(system, states, Skip::Within(allowance));
        if !levels(at_best).is_some_and(|levels| levels.may_leave_out()) {
            return Err(Refusal::Nothing);
        }
        let evaluations = EVALUATIONS.min((COST / system.cost()) as u64);
        let (response, course) = Response::measure(system, states, duration, evaluations)?;
        let allowance = with(response);
        let mut levels = Levels::new(system, states, Skip::Within(allowance));
        let mut leaves_out = |states: &Vec<BodyState>| {
            levels.as_mut().is_some_and(|levels| {
                levels.reset(states);
                levels.may_leave_out()
            })
        };
        if course.iter().any(&mut leaves_out) {
            Ok(allowance)
        } else {
            let response = allowance.response;
            Err(Refusal::Never { response })
        }
    }

    /// The part of the allowance that this neglect uses.
    pub fn part(&self, neglect: &Neglect) -> f64 {
        let acceleration = neglect.acceleration / self.length;
        acceleration.max(neglect.angular_acceleration) / self.perturbation
    }
}

impl Skip {
    /// The omissions allowed in such a run, or [`Skip::Exact`] if no [`Allowance`] exists.
    pub fn within(
        system: &mut System,
        states: &[BodyState],
        duration: f64,
        tolerance: f64,
    ) -> Self {
        Allowance::new(system, states, duration, tolerance).map_or(Self::Exact, Self::Within)
    }
}
