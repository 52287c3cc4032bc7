use super::drift::kick;
use super::{Integrator, MethodError, StepError, StepReport, accept};
use crate::rotation::FreeRotation;
use crate::{BodyState, Load, Mobility, System};

/// The exact motion of free bodies, in closed form from an origin state: `x(t) = x₀ + (t/m) γ`, `R(t) = R₀ F(t)`,
/// `Π(t) = F(t)ᵀ Π₀` with the `F` of [`FreeRotation`]. The cost does not depend on the time, and errors grow only with
/// the rounding of the phase.
///
/// # Assumptions and limitations
/// No gravity acts. A control acts as half an impulse at each end of its step, which is of second order. The closed
/// form then restarts from the resulting state.
pub struct ClosedForm {
    rotations: Vec<FreeRotation>,
    /// States at the origin of the current motion, and the number of steps of length `h` since then.
    origin: Vec<BodyState>,
    steps: u64,
    h: f64,
    next: Vec<BodyState>,
}

impl ClosedForm {
    /// Creates the method for `system`, on which no gravity may act.
    pub fn new(system: &System) -> Result<Self, MethodError> {
        if !system.is_free() {
            return Err(MethodError::Gravity {
                method: "the closed form",
            });
        }
        let bodies = system.bodies();
        Ok(Self {
            rotations: bodies
                .iter()
                .map(|body| FreeRotation::new(body.inertia()))
                .collect(),
            origin: Vec::with_capacity(bodies.len()),
            steps: 0,
            h: 0.0,
            next: Vec::with_capacity(bodies.len()),
        })
    }

    /// Starts a new motion from `states`.
    fn depart(&mut self, states: &[BodyState]) {
        self.origin.clear();
        self.origin.extend_from_slice(states);
        self.steps = 0;
    }

    /// Sets `next` to the states at time `t` after the origin.
    fn follow(&mut self, system: &System, t: f64) {
        self.next.clear();
        let bodies = system.bodies().iter().zip(&self.rotations);
        for ((body, rotation), origin) in bodies.zip(&self.origin) {
            let state = match body.mobility() {
                Mobility::Fixed => *origin,
                Mobility::Driven(drive) => drive.advance(body, origin, t),
                Mobility::Free | Mobility::Pivoted => {
                    let (turn, angular_momentum) = rotation.flow(&origin.angular_momentum, t);
                    BodyState {
                        position: origin.position + (t / body.mass()) * origin.linear_momentum,
                        attitude: turn.compose(&origin.attitude),
                        angular_momentum,
                        ..*origin
                    }
                }
            };
            self.next.push(state);
        }
    }
}

impl Integrator for ClosedForm {
    fn start(&mut self, _system: &mut System, states: &[BodyState]) {
        self.depart(states);
    }

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        let controlled = controls.iter().any(|control| *control != Load::default());
        if controlled || h != self.h {
            self.depart(states);
            self.h = h;
        }
        if controlled {
            let half = 0.5 * h;
            kick(system.bodies(), &mut self.origin, controls, half);
            self.follow(system, h);
            kick(system.bodies(), &mut self.next, controls, half);
            let made = accept(system, &self.next, states);
            // Also restart after a failure, because the origin has been kicked.
            self.depart(states);
            made?;
        } else {
            self.follow(system, (self.steps + 1) as f64 * h);
            accept(system, &self.next, states)?;
            self.steps += 1;
        }
        Ok(StepReport::default())
    }
}
