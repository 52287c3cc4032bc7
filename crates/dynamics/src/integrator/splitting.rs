use super::drift::{Drift, kick};
use super::{Integrator, Rotor, StepError, StepReport, accept};
use crate::{BodyState, Load, RigidBody, System};

/// Kicks and drifts in turn: `K(b₀h) D(a₀h) K(b₁h) … D(a_{s−1}h) K(b_s h)`.
///
/// A kick K is what gravity and controls do to the momenta in a time at rest; a drift D is free motion of all bodies,
/// its rotation computed by a [`Rotor`]. Both keep total linear and angular momentum under mutual gravity, and both
/// are symplectic; so is every such method. A load that a step ends with is the one that the next begins with.
///
/// # Assumptions and limitations
/// The discrete rotor solves an implicit equation that has a solution only up to about 90° a drift, else
/// [`StepError::Unsolvable`].
pub struct Splitting {
    kicks: Vec<f64>,
    drifts: Vec<f64>,
    drift: Drift,
    loads: Vec<Load>,
    next_loads: Vec<Load>,
    /// Whether `loads` belong to the present states.
    current: bool,
    next: Vec<BodyState>,
}

impl Splitting {
    /// With coefficients `b` of kicks, one more than `a` of drifts.
    pub(super) fn new(kicks: &[f64], drifts: &[f64], rotor: Rotor, bodies: &[RigidBody]) -> Self {
        Self {
            kicks: kicks.to_vec(),
            drifts: drifts.to_vec(),
            drift: Drift::new(rotor, bodies, drifts.len()),
            loads: vec![Load::default(); bodies.len()],
            next_loads: vec![Load::default(); bodies.len()],
            current: false,
            next: Vec::with_capacity(bodies.len()),
        }
    }

    /// The Lie group variational integrator in Hamiltonian form, (3.22)–(3.26): second order, symplectic,
    /// time-reversible; one evaluation of gravity a step.
    ///
    /// Half a kick, a drift, half a kick: with `p = Π_k + (h/2) M_k`, (3.24) is `h S(p) = F J_d − J_d Fᵀ` and (3.25) is
    /// `Π_{k+1} = Fᵀ p + (h/2) M_{k+1}`; likewise (3.22), (3.23) for the position.
    pub fn lgvi(rotor: Rotor, bodies: &[RigidBody]) -> Self {
        Self::new(&[0.5, 0.5], &[1.0], rotor, bodies)
    }

    /// The Lie–Euler method, (4.19)–(4.23): first order; one evaluation of gravity a step. The discrete optimal control
    /// problem is posed in it. A drift, then a kick by what acts at its end: a control enters as an impulse at the end.
    pub fn lie_euler(rotor: Rotor, bodies: &[RigidBody]) -> Self {
        Self::new(&[0.0, 1.0], &[1.0], rotor, bodies)
    }

    /// What gravity exerts where the last step ended; of a method that ends with a kick.
    pub(super) fn loads(&self) -> &[Load] {
        &self.loads
    }
}

impl Integrator for Splitting {
    fn start(&mut self, system: &mut System, states: &[BodyState]) {
        self.drift.start();
        system.loads(states, &mut self.loads);
        self.current = true;
    }

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        self.next.clear();
        self.next.extend_from_slice(states);
        let mut report = StepReport::default();
        if self.kicks[0] != 0.0 {
            if !self.current {
                system.loads(states, &mut self.loads);
                self.current = true;
            }
            let dt = self.kicks[0] * h;
            kick(system.bodies(), &mut self.next, &self.loads, controls, dt);
        }
        for (stage, (a, b)) in self.drifts.iter().zip(&self.kicks[1..]).enumerate() {
            let iterations = self
                .drift
                .apply(system.bodies(), &mut self.next, stage, a * h)?;
            report.iterations = report.iterations.max(iterations);
            if *b != 0.0 {
                system.loads(&self.next, &mut self.next_loads);
                let dt = b * h;
                kick(
                    system.bodies(),
                    &mut self.next,
                    &self.next_loads,
                    controls,
                    dt,
                );
            }
        }
        accept(system, &self.next, states)?;
        self.drift.accept();
        self.current = self.kicks.last().is_some_and(|&b| b != 0.0);
        std::mem::swap(&mut self.loads, &mut self.next_loads);
        Ok(report)
    }
}
