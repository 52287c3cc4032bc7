use crate::integrator::flow::{Components, pack, unpack};
use crate::integrator::stages::Stages;
use crate::integrator::tableau::{self, Tableau};
use crate::integrator::{Integrator, StepError, StepReport, accept};
use crate::{BodyState, Load, RigidBody, System};

/// An explicit Runge–Kutta method with fixed step, applied to x, γ, the nine entries of R, and Π.
///
/// # Assumptions and limitations
/// R leaves SO(3) by the error of the method and is not projected back. The method is neither symplectic nor
/// time-reversible: energy and angular momentum drift.
pub struct RungeKutta {
    tableau: &'static Tableau,
    stages: Stages,
    y: Vec<Components>,
    end: Vec<Components>,
    next: Vec<BodyState>,
}

impl RungeKutta {
    fn new(tableau: &'static Tableau, bodies: &[RigidBody]) -> Self {
        let count = bodies.len();
        Self {
            tableau,
            stages: Stages::new(tableau.stages.len(), count),
            y: Vec::with_capacity(count),
            end: vec![[0.0; 18]; count],
            next: Vec::with_capacity(count),
        }
    }

    /// The explicit midpoint rule of second order, with two gravity evaluations per step. The paper's "RK" (§3.4).
    pub fn explicit_midpoint(bodies: &[RigidBody]) -> Self {
        Self::new(&tableau::EXPLICIT_MIDPOINT, bodies)
    }

    /// The classical method of fourth order (Kutta 1901), with four gravity evaluations per step.
    pub fn classical(bodies: &[RigidBody]) -> Self {
        Self::new(&tableau::CLASSICAL, bodies)
    }

    /// The formula of eighth order of [`Adaptive::fehlberg78`](crate::integrator::Adaptive::fehlberg78), with fixed
    /// step.
    pub fn fehlberg8(bodies: &[RigidBody]) -> Self {
        Self::new(&tableau::FEHLBERG.tableau, bodies)
    }

    /// The formula of eighth order of [`Adaptive::dormand_prince853`](crate::integrator::Adaptive::dormand_prince853),
    /// with fixed step.
    pub fn dormand_prince8(bodies: &[RigidBody]) -> Self {
        Self::new(&tableau::DORMAND_PRINCE.tableau, bodies)
    }
}

impl Integrator for RungeKutta {
    fn start(&mut self, _system: &mut System, _states: &[BodyState]) {}

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        self.y.clear();
        self.y.extend(states.iter().map(pack));
        self.stages.set_controls(controls);
        for (index, stage) in self.tableau.stages.iter().enumerate() {
            self.stages.evaluate(system, &self.y, h, stage, index);
        }
        self.stages
            .finish(system, &self.y, h, self.tableau.weights, &mut self.end);
        self.next.clear();
        self.next.extend(self.end.iter().map(unpack));
        accept(system, &self.next, states)?;
        Ok(StepReport::default())
    }
}
