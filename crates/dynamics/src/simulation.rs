use crate::{BodyState, Integrator, Invariants, Load, Method, StepError, StepReport, System};

/// A system on its way: bodies, states, integrator and the number of steps made.
pub struct Simulation {
    system: System,
    states: Vec<BodyState>,
    integrator: Box<dyn Integrator>,
    h: f64,
    step: u64,
}

impl Simulation {
    /// From `states` (one a body) at step 0, with step `h`.
    pub fn new(mut system: System, states: Vec<BodyState>, method: Method, h: f64) -> Self {
        let mut integrator = method.integrator(h, states.len());
        integrator.start(&mut system, &states);
        Self {
            system,
            states,
            integrator,
            h,
            step: 0,
        }
    }

    /// Makes one step under gravity and `controls` (one a body). On an error the simulation stays where it was.
    pub fn advance(&mut self, controls: &[Load]) -> Result<StepReport, StepError> {
        let report = self
            .integrator
            .step(&mut self.system, &mut self.states, controls)?;
        self.step += 1;
        Ok(report)
    }

    /// The bodies and their gravity.
    pub fn system(&self) -> &System {
        &self.system
    }

    /// The states, one a body.
    pub fn states(&self) -> &[BodyState] {
        &self.states
    }

    /// Steps made.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// The time since the start: `step × h`, never a running sum.
    pub fn time(&self) -> f64 {
        self.step as f64 * self.h
    }

    /// The invariants of the present states.
    pub fn invariants(&self) -> Invariants {
        Invariants::of(&self.system, &self.states)
    }
}
