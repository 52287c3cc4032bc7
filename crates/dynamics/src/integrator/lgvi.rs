use super::drift::{Drift, kick};
use super::{Integrator, StepError, StepReport, accept};
use crate::rotation::Chart;
use crate::{BodyState, Load, System};

/// The Lie group variational integrator in Hamiltonian form, (3.22)–(3.26): second order, symplectic, time-reversible;
/// total linear and angular momentum exact; one evaluation of gravity a step.
///
/// A control is constant over the step and adds to the loads at both of its ends.
///
/// # Assumptions and limitations
/// Fixed step; a body may turn by less than about 90° a step, else [`StepError::Unsolvable`].
pub struct Lgvi {
    h: f64,
    drift: Drift,
    loads: Vec<Load>,
    next: Vec<BodyState>,
    next_loads: Vec<Load>,
}

impl Lgvi {
    /// With step `h` for `bodies` bodies, the implicit equation solved in `chart`.
    pub fn new(h: f64, chart: Chart, bodies: usize) -> Self {
        Self {
            h,
            drift: Drift::new(h, chart, bodies),
            loads: vec![Load::default(); bodies],
            next: Vec::with_capacity(bodies),
            next_loads: vec![Load::default(); bodies],
        }
    }
}

impl Integrator for Lgvi {
    fn start(&mut self, system: &mut System, states: &[BodyState]) {
        self.drift.start();
        system.loads(states, &mut self.loads);
    }

    /// Half a kick, a drift, half a kick: with `p = Π_k + (h/2) M_k`, (3.24) is `h S(p) = F J_d − J_d Fᵀ` and (3.25)
    /// is `Π_{k+1} = Fᵀ p + (h/2) M_{k+1}`; likewise (3.22), (3.23) for the position.
    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
    ) -> Result<StepReport, StepError> {
        self.next.clear();
        self.next.extend_from_slice(states);
        kick(&mut self.next, &self.loads, controls, 0.5 * self.h);
        let iterations = self.drift.apply(system.bodies(), &mut self.next)?;
        system.loads(&self.next, &mut self.next_loads);
        kick(&mut self.next, &self.next_loads, controls, 0.5 * self.h);

        accept(&self.next, states)?;
        self.drift.accept();
        std::mem::swap(&mut self.loads, &mut self.next_loads);
        Ok(StepReport { iterations })
    }
}
