use super::super::scale::Scale;
use crate::{BodyState, RigidBody};

/// Part of the step that would just meet the tolerance that is taken.
const SAFETY: f64 = 0.9;

/// Factors by which a step may differ from the one before.
const FACTORS: [f64; 2] = [1.0 / 3.0, 6.0];

/// Chooses steps such that their error, of order `h⁸`, is the tolerance: `h ← 0.9 h (error / tolerance)^(−1/8)`, within
/// limits, and no growth after a failure (Hairer, Nørsett, Wanner, §II.4; limits as in their code DOP853).
#[derive(Default)]
pub(super) struct StepSize {
    step: f64,
    /// The longest step that was good enough.
    longest: f64,
    failed: bool,
}

impl StepSize {
    /// Whether there has been a guess.
    pub(super) fn is_known(&self) -> bool {
        self.step > 0.0
    }

    /// The longest step so far, or the first: a time over which errors of momenta are measured.
    pub(super) fn longest(&self) -> f64 {
        if self.longest > 0.0 {
            self.longest
        } else {
            self.step
        }
    }

    /// The next step's length; `otherwise` where nothing moves.
    pub(super) fn get(&mut self, otherwise: f64) -> f64 {
        if self.step == f64::INFINITY {
            self.step = otherwise;
        }
        self.step
    }

    /// Guesses the first step from the shortest time in which a body, by its velocity or acceleration, moves as far as it is
    /// away from the origin or large, or turns by a radian. `bodies` are scales, bodies, states and their derivatives.
    pub(super) fn guess<'a>(
        &mut self,
        tolerance: f64,
        bodies: impl Iterator<Item = (&'a Scale, &'a RigidBody, BodyState, BodyState)>,
    ) {
        let mut rate = 0.0_f64;
        for (scale, body, state, derivative) in bodies {
            let distance = state.position.norm() + scale.length();
            rate = rate
                .max(state.velocity(body).norm() / distance)
                .max((derivative.velocity(body).norm() / distance).sqrt())
                .max(state.angular_velocity(body).norm())
                .max(derivative.angular_velocity(body).norm().sqrt());
        }
        self.step = eighth_root(tolerance) / rate;
        self.failed = false;
    }

    /// Whether a step with `error`, in units of the tolerance, was good enough. Chooses the next.
    pub(super) fn judge(&mut self, error: f64) -> bool {
        let good = error <= 1.0;
        let [least, greatest] = FACTORS;
        let greatest = if !good || self.failed { 1.0 } else { greatest };
        // An error that is not a number gives the least factor.
        let factor = (SAFETY / eighth_root(error)).min(greatest).max(least);
        if good {
            self.longest = self.longest.max(self.step);
        }
        self.step *= if error.is_nan() { least } else { factor };
        self.failed = !good;
        good
    }
}

fn eighth_root(x: f64) -> f64 {
    x.sqrt().sqrt().sqrt()
}
