use super::{Integrator, MethodError, StepError, StepReport};
use crate::{BodyState, Load, Mobility, System};

/// Relative change of the force over a step that counts as resolved.
const FORCE: f64 = 0.1;

/// Fraction of a body's momentum below which the effect of a change of force within a step is ignored.
const MATTERS: f64 = 1e-3;

/// Change (rad) of a body's rotation within a step, caused by the change of the moment, that counts as resolved.
const TURN: f64 = 0.05;

/// Halves a step that another integrator cannot make or that does not resolve the motion, and halves it repeatedly up
/// to a limit. [`StepReport::cuts`] counts the resulting steps. If the shortest step fails, its error is returned.
///
/// A step from loads `f, M` to loads `f', M'` resolves the motion of a body if `|f' − f|` is at most a tenth of the
/// larger of both (or could not change the momentum by a thousandth within the step), and `h² |J⁻¹ (M' − M)|` is at
/// most 0.05 rad.
///
/// # Assumptions and limitations
/// While the step length varies, the energy error of a symplectic method need not remain bounded. The check costs two
/// more gravity evaluations per step. A close approach inside a body's radius is reported without subdivision.
pub struct Subdivision {
    inner: Box<dyn Integrator>,
    /// States at the beginning of the step being divided, one per level.
    begun: Vec<Vec<BodyState>>,
    loads: Vec<Load>,
    next_loads: Vec<Load>,
}

impl Subdivision {
    /// Divides each step of `inner` into at most `2^depth` steps.
    pub fn new(inner: Box<dyn Integrator>, depth: u32, bodies: usize) -> Self {
        let levels = depth as usize + 1;
        Self {
            inner,
            begun: (0..levels).map(|_| Vec::with_capacity(bodies)).collect(),
            loads: vec![Load::default(); bodies],
            next_loads: vec![Load::default(); bodies],
        }
    }

    /// Makes one step at a level. Level 0 is the shortest.
    fn attempt(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
        level: usize,
    ) -> Result<StepReport, StepError> {
        self.begun[level].clear();
        self.begun[level].extend_from_slice(states);
        let whole = self
            .inner
            .step(system, states, controls, h)
            .and_then(|report| self.resolved(system, states, h, level).map(|()| report));
        let error = match whole {
            Ok(report) => {
                system.check_step(&self.begun[level], states, h);
                return Ok(report);
            }
            Err(error) => error,
        };
        states.copy_from_slice(&self.begun[level]);
        self.inner.start(system, states);
        if level == 0 || matches!(error, StepError::CloseApproach(_)) {
            return Err(error);
        }
        let half = 0.5 * h;
        let first = self.attempt(system, states, controls, half, level - 1)?;
        let second = self.attempt(system, states, controls, half, level - 1)?;
        Ok(first.then(second))
    }

    fn resolved(
        &mut self,
        system: &mut System,
        states: &[BodyState],
        h: f64,
        level: usize,
    ) -> Result<(), StepError> {
        system.loads(&self.begun[level], &mut self.loads);
        system.loads(states, &mut self.next_loads);
        for (index, body) in system.bodies().iter().enumerate() {
            let (before, after) = (&self.loads[index], &self.next_loads[index]);
            let free = *body.mobility() == Mobility::Free;
            if body.mobility().is_given() {
                continue;
            }
            let forces = [
                before.force + body.drag_force(&self.begun[level][index]),
                after.force + body.drag_force(&states[index]),
            ];
            let change = (forces[1] - forces[0]).norm();
            let force = forces[0].norm().max(forces[1].norm());
            let momentum = states[index].linear_momentum.norm();
            let moment = body.inertia().inverse() * (after.moment - before.moment);
            let excess = [
                (h.abs() * change / (MATTERS * momentum)).min(change / (FORCE * force)),
                h * h * moment.norm() / TURN,
            ];
            let excess = if free {
                excess[0].max(excess[1])
            } else {
                excess[1]
            };
            if excess > 1.0 {
                return Err(StepError::Unresolved {
                    body: index,
                    excess,
                });
            }
        }
        Ok(())
    }
}

impl Integrator for Subdivision {
    fn cuts_steps(&self) -> bool {
        true
    }

    fn check(&mut self, system: &mut System, states: &[BodyState]) -> Result<(), MethodError> {
        self.inner.check(system, states)
    }

    fn start(&mut self, system: &mut System, states: &[BodyState]) {
        self.inner.start(system, states);
    }

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        let top = self.begun.len() - 1;
        let report = self.attempt(system, states, controls, h, top);
        if report.is_err() {
            states.copy_from_slice(&self.begun[top]);
            self.inner.start(system, states);
        }
        report
    }
}
