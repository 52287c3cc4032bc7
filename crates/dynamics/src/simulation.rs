mod actuation;

use lgvi_lie::orthogonality_error;

use crate::docking::{Docked, Docking, Dockings};
use crate::gravity::Gravity;
use crate::integrator::Subdivision;
use crate::range::{check_body, check_step};
use crate::skip::{LevelSwitching, Skip};
use crate::{
    BodyState, Integrator, Invariants, Load, Method, MethodError, RigidBody, StepError, StepReport,
    System,
};
use actuation::Actuation;

/// A running simulation: system, states, integrator and the number of steps made.
pub struct Simulation {
    system: System,
    states: Vec<BodyState>,
    integrator: Box<dyn Integrator>,
    h: f64,
    substeps: u32,
    step: u64,
    /// Second buffer for the states, which alternates with `states`.
    next: Vec<BodyState>,
    /// States at the beginning of a step with several substeps.
    begun: Vec<BodyState>,
    dockings: Option<Box<Dockings>>,
    /// Of bodies with wheels or thrusters.
    actuation: Option<Box<Actuation>>,
}

/// Largest depth of subdivision. Dividing a step into `2³⁰` is practically unlimited.
const DEEPEST: u32 = 30;

impl Simulation {
    /// Creates a simulation from `states` (one per body) at step 0, with step `h`, which is negative for integration
    /// backwards in time.
    ///
    /// # Errors
    /// Returns the errors of [`with_integrator`](Self::with_integrator), and an error if `method` cannot integrate the
    /// system.
    pub fn new(
        system: System,
        states: Vec<BodyState>,
        method: Method,
        h: f64,
    ) -> Result<Self, MethodError> {
        check(&system, &states)?;
        let integrator = method.integrator(&system)?;
        Self::with_integrator(system, states, integrator, h)
    }

    /// Creates a simulation with any integrator.
    ///
    /// # Errors
    /// Returns an error if `states` does not contain one state per body, if a state is not finite or an attitude is not
    /// a rotation, if the step is 0 or not finite, if values are so large or small that their products overflow or
    /// underflow in double precision, or if the integrator is not for this motion.
    pub fn with_integrator(
        mut system: System,
        mut states: Vec<BodyState>,
        mut integrator: Box<dyn Integrator>,
        h: f64,
    ) -> Result<Self, MethodError> {
        check_step(h)?;
        check(&system, &states)?;
        let actuated = system.bodies().iter().any(RigidBody::has_actuators);
        system.constrain(&mut states);
        integrator.check(&mut system, &states)?;
        integrator.start(&mut system, &states);
        Ok(Self {
            next: states.clone(),
            begun: states.clone(),
            system,
            states,
            integrator,
            h,
            substeps: 1,
            step: 0,
            dockings: None,
            actuation: actuated.then(Box::default),
        })
    }

    /// Divides each step into `substeps` steps of the method. A value of 0 is treated as 1.
    pub fn with_substeps(self, substeps: u32) -> Self {
        Self {
            substeps: substeps.max(1),
            ..self
        }
    }

    /// Divides each step of the method into at most `2^depth` steps if it cannot be made as one, see [`Subdivision`].
    ///
    /// # Errors
    /// Returns an error for a depth above 30, and for methods with error control, which choose their own steps.
    pub fn with_subdivision(self, depth: u32) -> Result<Self, MethodError> {
        if depth > DEEPEST {
            let expected = "30 at most";
            return Err(refuse("depth of the subdivision", depth.into(), expected));
        }
        if self.integrator.cuts_steps() {
            let expected = "0, for the method finds its own steps";
            return Err(refuse("depth of the subdivision", depth.into(), expected));
        }
        let bodies = self.states.len();
        Ok(Self {
            integrator: Box::new(Subdivision::new(self.integrator, depth, bodies)),
            ..self
        })
    }

    /// Omits interactions as `skip` allows. Must be the last of these modifications.
    pub fn with_skips(mut self, skip: Skip) -> Self {
        self.integrator =
            LevelSwitching::over(self.integrator, &mut self.system, &self.states, skip);
        self
    }

    /// Lets bodies dock, see [`docking`](crate::docking). `gravity` creates the gravity of the system, and `simulation`
    /// a simulation like this one of another system. Must be the last of these modifications.
    ///
    /// # Errors
    /// Returns an error if the ports of a docking are not on two different free bodies, or if the method does not support
    /// the gravity of bodies that are joined.
    pub fn with_dockings(
        mut self,
        dockings: Vec<Docking>,
        gravity: impl Fn() -> Vec<Box<dyn Gravity>> + Send + 'static,
        simulation: impl Fn(System, Vec<BodyState>) -> Result<Self, MethodError> + Send + 'static,
    ) -> Result<Self, MethodError> {
        let (gravity, simulation) = (Box::new(gravity), Box::new(simulation));
        let dockings = Dockings::new((&self.system, &self.states), dockings, gravity, simulation)?;
        self.dockings = Some(Box::new(dockings));
        Ok(self)
    }

    /// Makes one step under gravity and `controls` (one per body). On an error the simulation remains unchanged.
    pub fn advance(&mut self, controls: &[Load]) -> Result<StepReport, StepError> {
        if controls.len() != self.states.len() {
            return Err(StepError::Controls {
                expected: self.states.len(),
                found: controls.len(),
            });
        }
        let made = if self.actuation.is_some() {
            self.advance_actuated(controls)
        } else {
            self.advance_once(controls)
        };
        self.step += u64::from(made.is_ok());
        made
    }

    /// Makes one step, in which wheels and thrusters do not act.
    #[inline(always)]
    fn advance_once(&mut self, controls: &[Load]) -> Result<StepReport, StepError> {
        let joined = match &mut self.dockings {
            Some(dockings) => dockings.advance(&self.system, &mut self.states, controls, self.step),
            None => None,
        };
        match joined {
            Some(made) => made,
            None if self.substeps == 1 => self.substep(controls, self.h),
            None => self.substeps(controls),
        }
    }

    /// Makes one step of the method.
    #[inline]
    fn substep(&mut self, controls: &[Load], h: f64) -> Result<StepReport, StepError> {
        let (system, next) = (&mut self.system, &mut self.next);
        let made = self
            .integrator
            .step_to(system, &self.states, next, controls, h);
        if made.is_ok() {
            std::mem::swap(&mut self.states, &mut self.next);
        }
        made
    }

    fn substeps(&mut self, controls: &[Load]) -> Result<StepReport, StepError> {
        self.begun.copy_from_slice(&self.states);
        let h = self.h / f64::from(self.substeps);
        let mut report = StepReport::default();
        for substep in 0..self.substeps {
            match self.substep(controls, h) {
                Ok(next) if substep == 0 => report = next,
                Ok(next) => report = report.then(next),
                Err(error) => {
                    if substep > 0 {
                        self.states.copy_from_slice(&self.begun);
                        self.integrator.start(&mut self.system, &self.states);
                    }
                    return Err(error);
                }
            }
        }
        Ok(report)
    }

    /// Continues from other states (one per body) at the current step. Bodies that have docked separate, and dock again at
    /// the next step if the conditions still hold.
    ///
    /// # Errors
    /// Returns the errors of [`new`](Self::new). The simulation then remains unchanged.
    pub fn set_states(&mut self, states: &[BodyState]) -> Result<(), MethodError> {
        check(&self.system, states)?;
        self.next.copy_from_slice(states);
        self.system.constrain(&mut self.next);
        self.integrator.check(&mut self.system, &self.next)?;
        std::mem::swap(&mut self.states, &mut self.next);
        self.integrator.start(&mut self.system, &self.states);
        if let Some(dockings) = &mut self.dockings {
            dockings.separate();
        }
        Ok(())
    }

    /// The dockings that have taken place since the start, in their order.
    pub fn docked(&self) -> &[Docked] {
        let dockings = self.dockings.as_ref();
        dockings.map_or(&[], |dockings| dockings.docked())
    }

    /// The number of changes of an interaction's level of detail so far.
    pub fn switches(&self) -> u64 {
        self.system.switches()
    }

    /// The bodies and their gravity.
    pub fn system(&self) -> &System {
        &self.system
    }

    /// The states, one per body.
    pub fn states(&self) -> &[BodyState] {
        &self.states
    }

    /// Number of steps made.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// The time since the start, computed as `step × h` and not as a running sum.
    pub fn time(&self) -> f64 {
        self.step as f64 * self.h
    }

    /// The invariants of the current states.
    pub fn invariants(&self) -> Invariants {
        Invariants::of(&self.system, &self.states)
    }
}

pub(crate) fn refuse(parameter: &'static str, value: f64, expected: &'static str) -> MethodError {
    MethodError::Parameter {
        method: "the simulation",
        parameter,
        value,
        expected,
    }
}

/// Checks that `states` are valid states of the system's bodies.
pub(crate) fn check(system: &System, states: &[BodyState]) -> Result<(), MethodError> {
    let (expected, found) = (system.bodies().len(), states.len());
    if expected != found {
        return Err(MethodError::StateCount { expected, found });
    }
    for (body, state) in states.iter().enumerate() {
        if !state.is_finite() {
            return Err(MethodError::State { body });
        }
        let orthogonality_error = orthogonality_error(&state.attitude);
        let determinant = state.attitude.determinant();
        // Methods that do not preserve rotations let attitudes deviate slightly. Their results must still be accepted
        // as input.
        if orthogonality_error > 0.1 || determinant < 0.0 {
            return Err(MethodError::Attitude {
                body,
                orthogonality_error,
                determinant,
            });
        }
        check_body(body, &system.bodies()[body], state)?;
    }
    Ok(())
}
