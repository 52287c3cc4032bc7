use super::drift::{Drift, kick};
use super::{Integrator, StepError, StepReport, accept};
use crate::rotation::Chart;
use crate::{BodyState, Load, System};

/// The Lie–Euler method, (4.19)–(4.23): first order, symplectic, total linear and angular momentum exact; one
/// evaluation of gravity a step. The discrete optimal control problem is posed in it.
///
/// A control is constant over the step and enters as an impulse at its end.
///
/// # Assumptions and limitations
/// Fixed step; a body may turn by less than about 90° a step, else [`StepError::Unsolvable`].
pub struct LieEuler {
    h: f64,
    drift: Drift,
    next: Vec<BodyState>,
    loads: Vec<Load>,
}

impl LieEuler {
    /// With step `h` for `bodies` bodies, the implicit equation solved in `chart`.
    pub fn new(h: f64, chart: Chart, bodies: usize) -> Self {
        Self {
            h,
            drift: Drift::new(h, chart, bodies),
            next: Vec::with_capacity(bodies),
            loads: vec![Load::default(); bodies],
        }
    }
}

impl Integrator for LieEuler {
    fn start(&mut self, _system: &mut System, _states: &[BodyState]) {
        self.drift.start();
    }

    /// A drift, (4.19), (4.21), (4.22), then a kick by what acts at its end, (4.20), (4.23).
    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
    ) -> Result<StepReport, StepError> {
        self.next.clear();
        self.next.extend_from_slice(states);
        let iterations = self.drift.apply(system.bodies(), &mut self.next)?;
        system.loads(&self.next, &mut self.loads);
        kick(&mut self.next, &self.loads, controls, self.h);

        accept(&self.next, states)?;
        self.drift.accept();
        Ok(StepReport { iterations })
    }
}
