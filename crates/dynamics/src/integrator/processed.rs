use super::drift::kick;
use super::{Integrator, Rotor, Splitting, StepError, StepReport, accept};
use crate::{BodyState, Load, RigidBody, System};

/// The Lie–Euler method between a pre- and a post-processor (§4.5): `K(−h/2) ∘ [K(h) D(h)]ⁿ ∘ K(h/2)`, which is the
/// Störmer–Verlet form `[K(h/2) D(h) K(h/2)]ⁿ` of (3.22)–(3.26) and so of second order.
///
/// The processor is half a kick of gravity, a symplectic map; as a kick leaves poses as they are, two halves are exactly a
/// whole, and the equivalence is exact with the discrete drift, which half a drift is not.
/// Controls are constant over a step and act in halves at both of its ends.
///
/// # Assumptions and limitations
/// Those of [`Splitting`]. The processed momenta are kept apart from those shown; a new start or another step length
/// processes anew.
pub struct ProcessedLieEuler {
    inner: Splitting,
    /// States before the post-processor.
    processed: Vec<BodyState>,
    next: Vec<BodyState>,
    after: Vec<BodyState>,
    loads: Vec<Load>,
    none: Vec<Load>,
    /// Step for which `processed` holds.
    h: Option<f64>,
}

impl ProcessedLieEuler {
    /// The method for `bodies`.
    pub fn new(rotor: Rotor, bodies: &[RigidBody]) -> Self {
        let count = bodies.len();
        Self {
            inner: Splitting::lie_euler(rotor, bodies),
            processed: Vec::with_capacity(count),
            next: Vec::with_capacity(count),
            after: Vec::with_capacity(count),
            loads: vec![Load::default(); count],
            none: vec![Load::default(); count],
            h: None,
        }
    }
}

impl Integrator for ProcessedLieEuler {
    fn start(&mut self, system: &mut System, states: &[BodyState]) {
        self.inner.start(system, states);
        system.loads(states, &mut self.loads);
        self.h = None;
    }

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        let half = 0.5 * h;
        if self.h != Some(h) {
            self.processed.clear();
            self.processed.extend_from_slice(states);
            let bodies = system.bodies();
            kick(bodies, &mut self.processed, &self.loads, half);
            self.h = Some(h);
        }
        self.next.clear();
        self.next.extend_from_slice(&self.processed);
        kick(system.bodies(), &mut self.next, controls, half);
        let report = self.inner.step(system, &mut self.next, &self.none, h)?;
        kick(system.bodies(), &mut self.next, controls, half);

        self.after.clear();
        self.after.extend_from_slice(&self.next);
        let loads = self.inner.loads();
        kick(system.bodies(), &mut self.next, loads, -half);
        accept(system, &self.next, states)?;
        self.loads.copy_from_slice(loads);
        std::mem::swap(&mut self.processed, &mut self.after);
        Ok(report)
    }
}
