use thiserror::Error;

use super::response::Response;
use super::{Levels, Skip};
use crate::gravity::Neglect;
use crate::{Accuracy, BodyState, StepError, System};

/// Evaluations of gravity that flights may take to learn how errors grow, and what they may cost in multiples of a point in a
/// central field.
const EVALUATIONS: u64 = 60_000;
const COST: f64 = 5e7;

/// How much of every body's acceleration may be neglected.
///
/// With at most `b` of it neglected throughout, in sizes of the scene and in rad per time squared, the state at the end of a
/// run of duration T errs by at most `∫ κ (T − t) b dt = ½ κ T² b`, in the measure of [`Accuracy`]. Here `κ`, how a change of
/// velocity grows, is measured in flights of the whole run: `b = 2 ε/(κ T²)` for a tolerance ε.
///
/// # Assumptions and limitations
/// What is neglected of the acceleration is bounded; what becomes of it is as certain as the measured κ, which is taken
/// twice as great as measured. Controls are none in the flights, and they start from the given states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowance {
    /// The error that is tolerated.
    pub tolerance: f64,
    /// `b`.
    pub perturbation: f64,
    /// Size of the scene.
    pub length: f64,
    /// κ.
    pub response: f64,
    /// Evaluations of gravity that took.
    pub evaluations: u64,
}

/// Why nothing is left out by a tolerance.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum Refusal {
    /// As the bodies are at the start.
    #[error("nothing would be negligible at the start, even if errors grew as in free motion")]
    Nothing,
    /// The flights are not as long as the run.
    #[error(
        "how errors grow is not known: flights of the whole run take more than {evaluations} evaluations of gravity"
    )]
    Costly {
        /// What one of them may take.
        evaluations: u64,
    },
    /// The motion cannot be flown.
    #[error("how errors grow is not known: a flight fails: {0}")]
    Flight(StepError),
    /// The flights part too far.
    #[error("errors grow too fast: a change of velocity by a millionth makes {error:.1e}")]
    Saturated {
        /// The error.
        error: f64,
    },
    /// Nothing may be left out at the distances that the bodies come to.
    #[error(
        "errors grow {response:.1} times as in free motion, too fast for anything to be negligible in the run"
    )]
    Never {
        /// κ.
        response: f64,
    },
}

impl Allowance {
    /// For a run of `duration` from `states` (one a body), so that the error at its end is `tolerance` as [`Accuracy`] measures it
    /// if errors grow as fast as κ says.
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

    /// What part of it this takes.
    pub fn part(&self, neglect: &Neglect) -> f64 {
        let acceleration = neglect.acceleration / self.length;
        acceleration.max(neglect.angular_acceleration) / self.perturbation
    }
}

impl Skip {
    /// What may be left out of such a run: [`Skip::Exact`] where there is no [`Allowance`].
    pub fn within(
        system: &mut System,
        states: &[BodyState],
        duration: f64,
        tolerance: f64,
    ) -> Self {
        Allowance::new(system, states, duration, tolerance).map_or(Self::Exact, Self::Within)
    }
}
