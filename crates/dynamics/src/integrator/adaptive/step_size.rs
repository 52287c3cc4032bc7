use super::super::scale::Scale;
use crate::{BodyState, RigidBody};

/// Safety factor on the step that would just meet the tolerance.
const SAFETY: f64 = 0.9;

/// Limits of the ratio of two successive steps.
const FACTORS: [f64; 2] = [1.0 / 3.0, 6.0];

/// Chooses steps whose error, of order `h⁸`, meets the tolerance: `h ← 0.9 h (error / tolerance)^(−1/8)`, within
/// limits, and without growth after a rejection (Hairer, Nørsett, Wanner, §II.4; limits as in their code DOP853).
#[derive(Default)]
pub(super) struct StepSize {
    step: f64,
    /// The longest accepted step.
    longest: f64,
    failed: bool,
}

impl StepSize {
    /// Returns true if a step size has been chosen.
    pub(super) fn is_known(&self) -> bool {
        self.step > 0.0
    }

    /// The longest step so far, or the first guess. It is the time scale in the error of momenta.
    pub(super) fn longest(&self) -> f64 {
        if self.longest > 0.0 {
            self.longest
        } else {
            self.step
        }
    }

    /// The size of the next step, or `otherwise` if nothing moves.
    pub(super) fn get(&mut self, otherwise: f64) -> f64 {
        if self.step == f64::INFINITY {
            self.step = otherwise;
        }
        self.step
    }

    /// Guesses the first step from the shortest time in which a body, by its velocity or acceleration, moves as far as
    /// its distance from the origin plus its size, or rotates by one radian. The items of `bodies` are a scale, a body,
    /// its state and the derivative of its state.
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

    /// Returns true if a step with `error`, in units of the tolerance, is accepted, and chooses the next step size.
    pub(super) fn judge(&mut self, error: f64) -> bool {
        let good = error <= 1.0;
        let [least, greatest] = FACTORS;
        let greatest = if !good || self.failed { 1.0 } else { greatest };
        // A NaN error gives the smallest factor.
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
