use super::Work;
use crate::{BodyState, Load, StepError, System};

/// A solution made of internal steps, of which the last one is stored. Times are relative to its start.
pub(in super::super) trait Solution: Send {
    /// The work so far, summed over all starts.
    fn work(&self) -> Work;

    /// Gravity evaluations per step.
    fn evaluations_a_step(&self) -> u64;

    /// The controls of the solution.
    fn controls(&self) -> &[Load];

    /// The time that the solution has reached.
    fn until(&self) -> f64;

    /// Sets `states` to those at the end of the last step.
    fn end(&mut self, system: &System, states: &mut Vec<BodyState>);

    /// Prepares for the kept interactions of `system`, and guesses the first step of the next start anew.
    fn prepare(&mut self, system: &System);

    /// Starts at `states` under `controls`.
    fn start(
        &mut self,
        system: &mut System,
        states: &[BodyState],
        controls: &[Load],
    ) -> Result<(), StepError>;

    /// Makes one step toward `target`, repeating it until its error is acceptable, and returns the number of attempts.
    fn advance(&mut self, system: &mut System, target: f64) -> Result<u32, StepError>;

    /// Sets `states` to those at `target`, which must be within the last step.
    fn show(&mut self, system: &mut System, target: f64, states: &mut Vec<BodyState>);
}
