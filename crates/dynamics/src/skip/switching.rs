use super::{Levels, Skip};
use crate::{BodyState, Integrator, Load, MethodError, StepError, StepReport, System};

/// Steps of another integrator, with changes of the interactions' levels between steps as the distances change.
///
/// A step that brings bodies closer to each other than the levels allow is repeated with higher levels.
pub(crate) struct LevelSwitching {
    inner: Box<dyn Integrator>,
    begun: Vec<BodyState>,
}

impl LevelSwitching {
    /// Applies the omissions of `skip` to `system`, starting from `states`. Returns `inner` itself if levels never
    /// change.
    pub(crate) fn over(
        mut inner: Box<dyn Integrator>,
        system: &mut System,
        states: &[BodyState],
        skip: Skip,
    ) -> Box<dyn Integrator> {
        let levels = Levels::new(system, states, skip);
        system.set_levels(levels);
        inner.start(system, states);
        if system.switches_levels() {
            let begun = states.to_vec();
            Box::new(Self { inner, begun })
        } else {
            inner
        }
    }

    #[cold]
    fn select(&mut self, system: &mut System, states: &[BodyState]) {
        system.select();
        self.inner.start(system, states);
    }
}

impl Integrator for LevelSwitching {
    fn cuts_steps(&self) -> bool {
        self.inner.cuts_steps()
    }

    fn check(&mut self, system: &mut System, states: &[BodyState]) -> Result<(), MethodError> {
        self.inner.check(system, states)
    }

    fn start(&mut self, system: &mut System, states: &[BodyState]) {
        if let Some(levels) = system.levels() {
            levels.reset(states);
        }
        self.select(system, states);
    }

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        let mut next = std::mem::take(&mut self.begun);
        let made = self.step_to(system, states, &mut next, controls, h);
        if made.is_ok() {
            states.copy_from_slice(&next);
        }
        self.begun = next;
        made
    }

    fn step_to(
        &mut self,
        system: &mut System,
        states: &[BodyState],
        next: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        let made = loop {
            let made = self.inner.step_to(system, states, next, controls, h);
            if made.is_ok() && !self.inner.cuts_steps() {
                system.check_step(states, next, h);
            }
            if !system.levels().is_some_and(Levels::take_breach) {
                break made;
            }
            self.select(system, states);
        };
        if made.is_ok() && system.levels().is_some_and(|levels| levels.update(next)) {
            self.select(system, next);
        }
        made
    }
}
