//! Galerkin Lie group variational integrators of arbitrary order (§2.2) and their reduced form (§2.3).

mod basis;
mod curve;
mod elimination;
mod euler_poincare;
mod gliding;
mod iteration;
#[cfg(test)]
mod legendre;
mod motion;
mod quadrature;
mod turning;

pub use euler_poincare::EulerPoincare;
pub use quadrature::Quadrature;

use self::basis::Basis;
use self::curve::Guess;
use self::motion::{Motion, Step};
use super::{Integrator, MethodError, StepError, StepReport, accept};
use crate::{BodyState, Load, Mobility, System};

/// Where the natural chart of a step, in which its rotation vectors are interpolated, has its center.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChartOrigin {
    /// At the attitude that the step starts from, `R(τ) = R_0 exp S(ξ(τ))`, as in the paper.
    Start,
    /// Half-way to the attitude that the step ends with: the method is its own adjoint, and time-reversible.
    #[default]
    Middle,
}

/// Highest degree: beyond, rounding in the interpolation outweighs what a longer step could gain.
const MAX_DEGREE: u32 = 10;

/// A Galerkin Lie group variational integrator (§2.2): order `2s` with polynomials of degree s and s points of Gauss'
/// or `s + 1` points of Lobatto's rule.
///
/// Over a step the center of mass is a polynomial of degree s, the attitude the exponential of one in the natural chart,
/// `R(τ) = C exp S(ξ(τ))`; the discrete Lagrangian is the extremum over inner control points of the action
/// `h Σ b_i [½ m |ẋ|² + ½ ΩᵀJΩ − U]` at the quadrature nodes, with `Ω = J_r(ξ) ξ̇`. A step solves `(γ_0, Π_0) = −D_1 L_d`
/// and goes on from `(γ_1, Π_1) = D_2 L_d`, momenta left-trivialized; controls enter by the discrete
/// Lagrange–d'Alembert principle in the same quadrature. Interpolation is equivariant under Euclidean motions (Lemmas 2.1,
/// 2.2), so total momenta are kept as by the exact flow; the method is symplectic.
///
/// The equations of each body's rotation are solved by Newton's method with the kinetic energy's Jacobian, the loads
/// following by iteration, down to rounding. Where that stalls, Newton's method takes all bodies at once; where that fails
/// too, the solution is followed from those of shorter steps. Degree 4 reaches an error of 2e-7 on two dumbbells (reference
/// a1 at time 1) in 12 steps, each as costly as some 80 of the [LGVI](super::Splitting::lgvi), which needs 40 000 for it.
///
/// # Assumptions and limitations
/// A body may turn by less than π in one step, else [`StepError::TurnsTooFar`]. With [`ChartOrigin::Start`] and `s > 1` the
/// method is not time-reversible: a polynomial in the chart at one end is none in the chart at the other. Degree 1 suits
/// slender bodies badly, the LGVI does better there. Gravity is evaluated at every quadrature point in every pass. Where two
/// solutions of the equations are near each other, as in steps that do not resolve the motion, either may be found. Memory
/// grows as the square of degree times bodies.
pub struct Galerkin {
    motion: Motion,
    next: Vec<BodyState>,
    /// Length of the last step.
    h: Option<f64>,
}

/// Unknowns of the largest step: where the bodies are solved for together, a matrix of their square is.
const MOST_UNKNOWNS: usize = 1500;

impl Galerkin {
    /// Degree `s`, 1 to 10, and quadrature with at least s points.
    pub fn new(
        system: &System,
        degree: u32,
        quadrature: Quadrature,
        origin: ChartOrigin,
    ) -> Result<Self, MethodError> {
        let basis = Basis::checked("Galerkin", degree, quadrature, origin)?;
        let unknowns = 6 * basis.degree * system.bodies().len();
        if unknowns > MOST_UNKNOWNS {
            return Err(MethodError::Parameter {
                method: "Galerkin",
                parameter: "number of unknowns, 6 times degree and bodies,",
                value: unknowns as f64,
                expected: "1500 at most",
            });
        }
        Ok(Self {
            motion: Motion::new(basis, system.bodies()),
            next: Vec::with_capacity(system.bodies().len()),
            h: None,
        })
    }

    /// The states at the end of a solved step.
    fn finish(&mut self, system: &System, step: Step<'_>) -> Result<(), StepError> {
        let Step { states, h, .. } = step;
        let motion = &self.motion;
        let basis = &motion.basis;
        self.next.clear();
        for (index, (body, state)) in system.bodies().iter().zip(states).enumerate() {
            let mut next = *state;
            if let Mobility::Driven(drive) = body.mobility() {
                next = drive.advance(body, state, h);
            }
            if let Some(turning) = &motion.turning[index] {
                turning.check(basis, index)?;
                (next.attitude, next.angular_momentum) =
                    turning.end(basis, &state.attitude, &state.angular_momentum);
            }
            if let Some(gliding) = &motion.gliding[index] {
                next.position += gliding.curve.points[basis.degree - 1];
                for (load, weight) in motion.loads_on(index).zip(&basis.weights) {
                    next.linear_momentum += h * weight * load.force;
                }
            }
            self.next.push(next);
        }
        Ok(())
    }
}

impl Integrator for Galerkin {
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
        let step = Step {
            states,
            controls,
            h,
        };
        let iterations = self
            .motion
            .solve(system, step, Guess::after(self.h.take(), h))
            .map_err(|stall| stall.explain(system.bodies(), states, h))?;
        self.finish(system, step)?;
        accept(system, &self.next, states)?;
        self.motion.remember();
        self.h = Some(h);
        Ok(StepReport {
            iterations,
            cuts: 0,
        })
    }
}
