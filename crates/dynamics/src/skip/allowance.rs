use super::response::Response;
use super::{Skip, Watch};
use crate::auto::Accuracy;
use crate::gravity::Neglect;
use crate::{BodyState, System};

/// Evaluations of gravity that flights may take to learn how errors grow, and what they may cost in multiples of a point in a
/// central field.
pub const EVALUATIONS: u64 = 60_000;
const COST: f64 = 5e7;

/// How much of every body's acceleration may be neglected.
///
/// With at most `b` of it neglected throughout, in sizes of the scene and in rad per time squared, the state at the end of a
/// run of duration T errs by at most `∫ κ (T − t) b dt = ½ κ T² b`, in the measure of [`Accuracy`]. Here `κ`, how a change of
/// velocity grows, is measured in flights: `b = 2 ε/(κ T²)` for a tolerance ε.
///
/// # Assumptions and limitations
/// What is neglected of the acceleration is bounded; what becomes of it is as certain as the measured κ, which is taken
/// twice as great as measured. After the flights, errors are taken to grow on as in them. Controls are none in the flights.
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
    /// Time for which κ was measured.
    pub horizon: f64,
    /// Evaluations of gravity that took.
    pub evaluations: u64,
}

impl Allowance {
    fn new(tolerance: f64, length: f64, response: Response, duration: f64) -> Self {
        Self {
            tolerance,
            perturbation: 2.0 * tolerance / (response.factor * duration * duration),
            length,
            response: response.factor,
            horizon: response.horizon,
            evaluations: response.evaluations,
        }
    }

    /// What part of it this takes.
    pub fn part(&self, neglect: &Neglect) -> f64 {
        let acceleration = neglect.acceleration / self.length;
        acceleration.max(neglect.angular_acceleration) / self.perturbation
    }
}

impl Skip {
    /// What may be left out of a run of `duration` from `states` (one a body), so that the error at its end is at most
    /// `tolerance` as [`Accuracy`] measures it: [`Skip::Exact`] where errors grow too fast for anything beyond.
    ///
    /// # Assumptions and limitations
    /// Those of [`Allowance`].
    pub fn within(
        system: &mut System,
        states: &[BodyState],
        duration: f64,
        tolerance: f64,
    ) -> Self {
        let Accuracy { length } = Accuracy::new(system.bodies(), states);
        let at_best = Response {
            factor: 1.0,
            horizon: 0.0,
            evaluations: 0,
        };
        let with = |response| Self::Within(Allowance::new(tolerance, length, response, duration));
        let leaves =
            |skip| Watch::new(system, states, skip).is_some_and(|watch| watch.may_leave_out());
        if !leaves(with(at_best)) {
            return Self::Exact;
        }
        let evaluations = EVALUATIONS.min((COST / system.cost()) as u64);
        match Response::measure(system, states, duration, evaluations) {
            Some(response) => with(response),
            None => Self::Exact,
        }
    }
}
