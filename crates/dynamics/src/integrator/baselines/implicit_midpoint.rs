use super::anderson::Anderson;
use crate::integrator::flow::{Components, Flow, pack, place, unpack};
use crate::integrator::scale::Scale;
use crate::integrator::stages::advance;
use crate::integrator::{Integrator, StepError, StepReport, accept};
use crate::{BodyState, Load, RigidBody, System};

/// Change of an iterate, relative to [`Scale`], that may be due to rounding. Below it, the iteration stops as soon as a
/// change is more than half the previous one.
const ROUNDING: f64 = 1e-13;

/// Change below which the iteration always stops.
const ENOUGH: f64 = 2e-16;

/// Iteration limit.
const LIMIT: u32 = 200;

/// The implicit midpoint rule, `y_{k+1} = y_k + h f(½ (y_k + y_{k+1}))`, applied to x, γ, the nine entries of R, and Π;
/// the paper's "SRK" (§3.4). It is of second order and time-reversible, and takes one gravity evaluation per iteration.
///
/// `Y = y + ½h f(Y)` is solved to rounding by fixed-point iteration from a guess extrapolated from the last three
/// steps. If this converges slowly or not at all, Anderson acceleration takes over. Solved to rounding, the rule
/// conserves quadratic invariants (R stays on SO(3), `|R Π|` of a free body) to rounding.
///
/// # Assumptions and limitations
/// The rule is symmetric, but (R, Π) are not canonical coordinates, so it preserves their Poisson structure only to
/// second order (M. A. Austin, P. S. Krishnaprasad and L.-S. Wang, *Almost Poisson integration of rigid body systems*,
/// J. Comp. Phys. 107 (1993) 105–117). If the iteration does not converge, the step fails with
/// [`StepError::NotConverged`].
pub struct ImplicitMidpoint {
    flow: Flow,
    anderson: Anderson,
    scales: Vec<Scale>,
    y: Vec<Components>,
    /// The iterate Y, and the weights of its components.
    middle: Vec<Components>,
    weights: Vec<Components>,
    /// `y + ½h f(Y)`.
    value: Vec<Components>,
    k: Vec<Components>,
    /// Derivatives at the midpoints of the last steps.
    last: [Vec<Components>; 3],
    known: usize,
    next: Vec<BodyState>,
}

impl ImplicitMidpoint {
    /// Creates the method for `bodies`.
    pub fn new(bodies: &[RigidBody]) -> Self {
        let count = bodies.len();
        let zeros = || vec![[0.0; 18]; count];
        Self {
            flow: Flow::new(count),
            anderson: Anderson::new(count),
            scales: bodies.iter().map(Scale::new).collect(),
            y: Vec::with_capacity(count),
            middle: zeros(),
            weights: zeros(),
            value: zeros(),
            k: zeros(),
            last: [zeros(), zeros(), zeros()],
            known: 0,
            next: Vec::with_capacity(count),
        }
    }

    /// Computes the initial guess of Y: by an Euler step at first, then by extrapolation from the derivatives of the
    /// last steps.
    fn guess(&mut self, system: &mut System, h: f64) {
        let Self {
            flow, y, k, last, ..
        } = self;
        match self.known {
            0 => flow.evaluate(system, y, 0.0, |body, at| *at = y[body], k),
            known => {
                let [a, b, c] = match known {
                    1 => [1.0, 0.0, 0.0],
                    2 => [2.0, -1.0, 0.0],
                    _ => [3.0, -3.0, 1.0],
                };
                for (body, k) in k.iter_mut().enumerate() {
                    *k = std::array::from_fn(|i| {
                        a * last[0][body][i] + b * last[1][body][i] + c * last[2][body][i]
                    });
                }
            }
        }
        for (body, middle) in self.middle.iter_mut().enumerate() {
            *middle = self.k[body];
            advance(&self.y[body], 0.5 * h, middle);
        }
        for (body, scale) in self.scales.iter().enumerate() {
            self.weights[body] = scale.inverse(&self.y[body], &self.middle[body], h.abs());
        }
    }

    /// Evaluates `y + ½h f(Y)` and returns its largest change from Y.
    fn evaluate(&mut self, system: &mut System, h: f64) -> f64 {
        let Self {
            flow, y, middle, k, ..
        } = self;
        flow.evaluate(system, y, 0.5 * h, |body, at| *at = middle[body], k);
        let mut greatest = 0.0_f64;
        for (body, value) in self.value.iter_mut().enumerate() {
            *value = k[body];
            advance(&y[body], 0.5 * h, value);
            let weights = value.iter().zip(&middle[body]).zip(&self.weights[body]);
            for ((value, middle), weight) in weights {
                let change = (value - middle).abs() * weight;
                if change > greatest || change.is_nan() {
                    greatest = change;
                }
            }
        }
        greatest
    }

    fn solve(&mut self, system: &mut System, h: f64) -> Result<u32, StepError> {
        let mut last = f64::INFINITY;
        let mut accelerated = false;
        for iterations in 1..=LIMIT {
            let change = self.evaluate(system, h);
            if !change.is_finite() {
                return Err(self.failure(iterations, last));
            }
            if change <= ENOUGH || (change <= ROUNDING && change > 0.5 * last) {
                return Ok(iterations);
            }
            if !accelerated && change > 0.5 * last {
                accelerated = true;
                self.anderson.start();
            }
            if accelerated {
                self.anderson
                    .next(&mut self.middle, &self.value, &self.weights);
            } else {
                self.middle.copy_from_slice(&self.value);
            }
            last = change;
        }
        Err(self.failure(LIMIT, last))
    }

    /// The error of an iteration without a solution: the guess is not finite, or the iteration does not converge.
    fn failure(&self, iterations: u32, residual: f64) -> StepError {
        let finite = |y: &Components| unpack(y).is_finite();
        match self.value.iter().position(|y| !finite(y)) {
            Some(body) if iterations == 1 => StepError::NotFinite { body },
            _ => StepError::NotConverged {
                iterations,
                residual,
                tolerance: ROUNDING,
            },
        }
    }
}

impl Integrator for ImplicitMidpoint {
    fn start(&mut self, _system: &mut System, _states: &[BodyState]) {
        self.known = 0;
    }

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        self.y.clear();
        self.y.extend(states.iter().map(pack));
        self.flow.set_controls(controls);
        self.guess(system, h);
        let iterations = self.solve(system, h)?;
        self.next.clear();
        let mut end = [0.0; 18];
        for (index, (body, y)) in system.bodies().iter().zip(&self.y).enumerate() {
            place(body, y, h, &mut end, |end| {
                *end = self.k[index];
                advance(y, h, end);
            });
            self.next.push(unpack(&end));
        }
        accept(system, &self.next, states)?;
        self.last.rotate_right(1);
        self.last[0].copy_from_slice(&self.k);
        self.known = (self.known + 1).min(3);
        Ok(StepReport {
            iterations,
            cuts: 0,
        })
    }
}
