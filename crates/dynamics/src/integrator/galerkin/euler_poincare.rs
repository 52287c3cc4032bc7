use super::basis::Basis;
use super::curve::Guess;
use super::iteration::{Stall, iterate};
use super::turning::Turning;
use super::{ChartOrigin, Quadrature};
use crate::integrator::{Integrator, MethodError, StepError, StepReport, accept};
use crate::{BodyState, Load, Mobility, System};

/// The higher-order discrete Euler–Poincaré equations (§2.3) of free bodies: [`Galerkin`](super::Galerkin) reduced by
/// its symmetry, with the same trajectory to rounding.
///
/// The Lagrangian `l(η) = ½ ηᵀJη` does not depend on the attitude, and neither does `l_d(F) = ext h Σ b_i l(J_r(ξ) ξ̇)`
/// at `F = R_0ᵀR_1`. In terms of momenta, a step solves `Π_0 = −D_1`, an equation for F alone, and then computes `Π_1 =
/// Ad*_F Π_0 = FᵀΠ_0` and the reconstruction `R_1 = R_0 F`. The center of mass moves uniformly.
///
/// Controls are constant over a step, the force in the inertial frame and the moment in the body frame, so they do not
/// need the attitude either. The force acts exactly. The moment acts by the discrete Lagrange–d'Alembert principle with
/// the same quadrature, and has the same order.
///
/// # Assumptions and limitations
/// No gravity acts. A body must rotate by less than π in one step, otherwise the step returns
/// [`StepError::TurnsTooFar`].
pub struct EulerPoincare {
    basis: Basis,
    /// Rotation of each body.
    turning: Vec<Turning>,
    next: Vec<BodyState>,
    /// Length of the last step.
    h: Option<f64>,
}

const NAME: &str = "Euler–Poincaré";

/// Limit of Newton corrections.
const MAX_ITERATIONS: u32 = 40;

impl EulerPoincare {
    /// Creates the method with degree `s`, 1 to 10, and a quadrature with at least s points.
    pub fn new(
        system: &System,
        degree: u32,
        quadrature: Quadrature,
        origin: ChartOrigin,
    ) -> Result<Self, MethodError> {
        if !system.is_free() {
            return Err(MethodError::Gravity { method: NAME });
        }
        let basis = Basis::checked(NAME, degree, quadrature, origin)?;
        let bodies = system.bodies();
        Ok(Self {
            turning: bodies.iter().map(|_| Turning::new(&basis)).collect(),
            next: Vec::with_capacity(bodies.len()),
            h: None,
            basis,
        })
    }
}

impl Integrator for EulerPoincare {
    fn start(&mut self, _system: &mut System, _states: &[BodyState]) {
        self.h = None;
    }

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        let basis = &self.basis;
        let bodies = system.bodies();
        let mut report = StepReport::default();
        self.next.clear();
        for (index, (body, state)) in bodies.iter().zip(&*states).enumerate() {
            let control = controls.get(index).copied().unwrap_or_default();
            let mut next = *state;
            match body.mobility() {
                Mobility::Free => {
                    next.position +=
                        (h / body.mass()) * (state.linear_momentum + 0.5 * h * control.force);
                    next.linear_momentum += h * control.force;
                }
                Mobility::Pivoted => {}
                Mobility::Fixed | Mobility::Driven(_) => {
                    if let Mobility::Driven(drive) = body.mobility() {
                        next = drive.advance(body, state, h);
                    }
                    self.next.push(next);
                    continue;
                }
            }
            let momentum = &state.angular_momentum;
            let turning = &mut self.turning[index];
            let turn = h * state.angular_velocity(body);
            turning.guess(basis, &turn, Guess::after(self.h, h));
            let mut iterations = 0;
            iterate(MAX_ITERATIONS, &mut iterations, |linearize| {
                turning.sample(basis, body.inertia());
                turning.correct(
                    basis,
                    body.inertia(),
                    momentum,
                    h,
                    |_| control.moment,
                    linearize,
                );
                turning.curve.advance()
            })
            .map_err(|residual| {
                Stall {
                    iterations,
                    residual,
                }
                .explain(bodies, states, h)
            })?;
            turning.check(basis, index)?;
            (next.attitude, next.angular_momentum) = turning.end(basis, &state.attitude, momentum);
            report.iterations = report.iterations.max(iterations);
            self.next.push(next);
        }
        accept(system, &self.next, states)?;
        self.turning
            .iter_mut()
            .for_each(|turning| turning.curve.remember());
        self.h = Some(h);
        Ok(report)
    }
}
