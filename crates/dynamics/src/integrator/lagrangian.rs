use nalgebra::Vector3;

use super::{Integrator, MethodError, StepError, StepReport, accept};
use crate::{BodyState, Load, Mobility, System};

/// The Lie group variational integrator in Lagrangian form, (3.18)–(3.21), which computes the next pose from two poses
/// without momenta. For a free body it is the Lie group velocity Verlet method of §2.4.
///
/// Its internal state is the last change of pose: `Δx`, and `g` with `S(g) = F J_d − J_d Fᵀ`. With the impulses of
/// (3.18), (3.19), `Δx_{k+1} = Δx_k + (h²/m) f_k` and `g_{k+1} = F_kᵀ g_k + h² M_k` (the vector of `J_d F_k − F_kᵀ
/// J_d`, which is `F_kᵀ S(g_k) F_k`). The first change of pose follows from the initial momenta. The output momenta of
/// each step follow from the discrete Legendre transform, `γ_{k+1} = (m/h) Δx_k + (h/2) f_{k+1}`, `Π_{k+1} = F_kᵀ g_k /
/// h + (h/2) M_{k+1}`. The trajectory equals that of the Hamiltonian form (3.22)–(3.26) to rounding.
///
/// # Assumptions and limitations
/// Bodies must be free or pivoted. A body must rotate by less than about 90° per step, otherwise the step returns
/// [`StepError::Unsolvable`]. When the step length changes, the method restarts from the momenta. A control is constant
/// over the step, and half of its impulse acts at each end.
pub struct LagrangianLgvi {
    /// Changes of pose in the last step, before the impulse at its end.
    changes: Vec<Change>,
    next_changes: Vec<Change>,
    loads: Vec<Load>,
    next_loads: Vec<Load>,
    next: Vec<BodyState>,
    /// Length of the last step, or `None` before the first step.
    h: Option<f64>,
}

/// `Δx` and `Fᵀ g` of a step, and the initial guess for the next `F`.
#[derive(Clone, Copy, Debug, Default)]
struct Change {
    position: Vector3<f64>,
    turn: Vector3<f64>,
    correction: f64,
}

impl LagrangianLgvi {
    /// Creates the method for `system`.
    pub fn new(system: &System) -> Result<Self, MethodError> {
        let bodies = system.bodies();
        if let Some(body) = bodies.iter().position(|body| body.mobility().is_given()) {
            return Err(MethodError::Body {
                method: "the Lagrangian LGVI",
                body,
                expected: "bodies that are free or pivoted",
            });
        }
        let count = bodies.len();
        Ok(Self {
            changes: vec![Change::default(); count],
            next_changes: vec![Change::default(); count],
            loads: vec![Load::default(); count],
            next_loads: vec![Load::default(); count],
            next: Vec::with_capacity(count),
            h: None,
        })
    }
}

impl Integrator for LagrangianLgvi {
    fn start(&mut self, system: &mut System, states: &[BodyState]) {
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
        let begins = self.h != Some(h);
        self.next.clear();
        self.next.extend_from_slice(states);
        let mut report = StepReport::default();
        for (index, body) in system.bodies().iter().enumerate() {
            let state = &mut self.next[index];
            let (load, last) = (self.loads[index], &self.changes[index]);
            let impulse = 0.5 * h * (load + controls[index]).moment;
            let g = if begins {
                h * (state.angular_momentum + impulse)
            } else {
                last.turn + h * (0.5 * h * load.moment + impulse)
            };
            let guess = if begins { 0.0 } else { last.correction };
            let found = (body.inertia().rotation)
                .find(1.0, &g, guess)
                .map_err(|source| StepError::of_rotation(index, source))?;
            let turn;
            (state.attitude, turn) = found.rotation.carry(&state.attitude, &g);
            let mut change = Change {
                position: Vector3::zeros(),
                turn,
                correction: found.correction,
            };
            if *body.mobility() == Mobility::Free {
                let impulse = 0.5 * h * (load + controls[index]).force;
                let per_mass = h / body.mass();
                change.position = if begins {
                    per_mass * (state.linear_momentum + impulse)
                } else {
                    last.position + per_mass * (0.5 * h * load.force + impulse)
                };
                state.position += change.position;
            }
            self.next_changes[index] = change;
            report.iterations = report.iterations.max(found.iterations);
        }

        system.loads(&self.next, &mut self.next_loads);
        let after = system.bodies().iter().zip(&mut self.next).enumerate();
        for (index, (body, state)) in after {
            let change = &mut self.next_changes[index];
            let control = controls[index];
            change.turn += 0.5 * h * h * control.moment;
            state.angular_momentum = change.turn / h + 0.5 * h * self.next_loads[index].moment;
            if *body.mobility() == Mobility::Free {
                change.position += 0.5 * h * h / body.mass() * control.force;
                state.linear_momentum =
                    body.mass() / h * change.position + 0.5 * h * self.next_loads[index].force;
            }
        }
        accept(system, &self.next, states)?;
        std::mem::swap(&mut self.changes, &mut self.next_changes);
        std::mem::swap(&mut self.loads, &mut self.next_loads);
        self.h = Some(h);
        Ok(report)
    }
}
