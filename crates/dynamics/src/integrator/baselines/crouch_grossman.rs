use lgvi_lie::exp;
use nalgebra::Vector3;

use crate::integrator::{Integrator, StepError, StepReport, accept};
use crate::wheels::Wheels;
use crate::{BodyState, Load, Mobility, RigidBody, System};

/// The Crouch–Grossman method of second order with the coefficients of the explicit midpoint rule, the paper's "LGM"
/// (§3.4).
///
/// The middle stage has `R̄ = R exp(½h Ω)` and half an Euler step for the other components. The step is `R ← R exp(h b₁
/// Ω) exp(h b₂ Ω̄)` with `b₁ = 0` and `b₂ = 1`, and the explicit midpoint rule for x, γ and Π. So it differs from
/// [`RungeKutta::explicit_midpoint`](super::RungeKutta::explicit_midpoint) only in the attitude. It takes two gravity
/// evaluations and two exponentials per step (P. E. Crouch and R. Grossman, *Numerical integration of ordinary
/// differential equations on manifolds*, J. Nonlinear Sci. 3 (1993) 1–33).
///
/// # Assumptions and limitations
/// R stays on SO(3) up to rounding, which accumulates as √n. The method is neither symplectic nor time-reversible:
/// energy and angular momentum drift.
pub struct CrouchGrossman {
    middle: Vec<BodyState>,
    next: Vec<BodyState>,
    loads: Vec<Load>,
}

impl CrouchGrossman {
    /// Creates the method for `bodies`.
    pub fn new(bodies: &[RigidBody]) -> Self {
        let count = bodies.len();
        Self {
            middle: Vec::with_capacity(count),
            next: Vec::with_capacity(count),
            loads: vec![Load::default(); count],
        }
    }

    /// Advances a body from `state` by time `t`, with velocities taken from `rate`.
    fn advance(
        body: &RigidBody,
        state: &BodyState,
        rate: &BodyState,
        load: &Load,
        t: f64,
    ) -> BodyState {
        let (velocity, force) = match body.mobility() {
            Mobility::Free => {
                let force = load.force + body.drag_force(rate);
                (rate.velocity(body), force)
            }
            Mobility::Pivoted => Default::default(),
            Mobility::Fixed => return *state,
            Mobility::Driven(drive) => return drive.advance(body, state, t),
        };
        let omega = rate.angular_velocity(body);
        let stored = body.wheels().map_or_else(Vector3::zeros, Wheels::momentum);
        let moment = (rate.angular_momentum + stored).cross(&omega) + load.moment;
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
