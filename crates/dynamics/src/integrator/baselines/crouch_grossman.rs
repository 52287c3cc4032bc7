use lgvi_lie::exp;

use crate::integrator::{Integrator, StepError, StepReport, accept};
use crate::{BodyState, Load, Mobility, RigidBody, System};

/// The Crouch–Grossman method of second order with the coefficients of the explicit midpoint rule; the paper's "LGM"
/// (§3.4).
///
/// A stage with `R̄ = R exp(½h Ω)` and, for the rest, half an Euler step; then
/// `R ← R exp(h b₁ Ω) exp(h b₂ Ω̄)` with `b₁ = 0`, `b₂ = 1`, and x, γ, Π as the explicit midpoint rule has them, so that it
/// differs from [`RungeKutta::explicit_midpoint`](super::RungeKutta::explicit_midpoint) in the attitude alone. Two
/// evaluations of gravity and two exponentials a step (P. E. Crouch and R. Grossman, *Numerical integration of ordinary
/// differential equations on manifolds*, J. Nonlinear Sci. 3 (1993) 1–33).
///
/// # Assumptions and limitations
/// R stays on SO(3) to rounding, which accumulates as √n. Neither symplectic nor time-reversible: energy and angular
/// momentum drift.
pub struct CrouchGrossman {
    middle: Vec<BodyState>,
    next: Vec<BodyState>,
    loads: Vec<Load>,
}

impl CrouchGrossman {
    /// The method for `bodies`.
    pub fn new(bodies: &[RigidBody]) -> Self {
        let count = bodies.len();
        Self {
            middle: Vec::with_capacity(count),
            next: Vec::with_capacity(count),
            loads: vec![Load::default(); count],
        }
    }

    /// Where a body gets in time `t` from `state` with the derivative at `rate`.
    fn advance(
        body: &RigidBody,
        state: &BodyState,
        rate: &BodyState,
        load: &Load,
        t: f64,
    ) -> BodyState {
        let (velocity, force) = match body.mobility() {
            Mobility::Free => (rate.velocity(body), load.force),
            Mobility::Pivoted => Default::default(),
            Mobility::Fixed => return *state,
            Mobility::Driven(drive) => return drive.advance(body, state, t),
        };
        let omega = rate.angular_velocity(body);
        let moment = rate.angular_momentum.cross(&omega) + load.moment;
        BodyState {
            position: state.position + t * velocity,
            linear_momentum: state.linear_momentum + t * force,
            attitude: state.attitude * exp(&(t * omega)),
            angular_momentum: state.angular_momentum + t * moment,
        }
    }
}

impl Integrator for CrouchGrossman {
    fn start(&mut self, _system: &mut System, _states: &[BodyState]) {}

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        self.middle.clear();
        self.next.clear();
        system.loads(states, &mut self.loads);
        for (index, (body, state)) in system.bodies().iter().zip(&*states).enumerate() {
            let load = self.loads[index] + controls[index];
            self.middle
                .push(Self::advance(body, state, state, &load, 0.5 * h));
        }
        system.loads(&self.middle, &mut self.loads);
        for (index, (body, state)) in system.bodies().iter().zip(&*states).enumerate() {
            let load = self.loads[index] + controls[index];
            self.next
                .push(Self::advance(body, state, &self.middle[index], &load, h));
        }
        accept(system, &self.next, states)?;
        Ok(StepReport::default())
    }
}
