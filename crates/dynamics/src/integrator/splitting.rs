use super::backup::Backup;
use super::drift::{Drift, Kick};
use super::turn::Turns;
use super::{Integrator, Rotor, StepError, StepReport, check_finite};
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
    /// Coefficients of kicks and drifts, each drift after its kick.
    stages: Vec<Stage>,
    /// Coefficient of the kick after all drifts.
    last_kick: f64,
    drift: Drift,
    loads: Vec<Load>,
    next_loads: Vec<Load>,
    /// Whether `loads` belong to the present states.
    current: bool,
    /// Where the present step began.
    begun: Backup,
}

/// A kick `K(bh)`, then a drift `D(ah)`.
struct Stage {
    b: f64,
    a: f64,
    turns: Turns,
}

impl Splitting {
    /// With coefficients `b` of kicks, one more than `a` of drifts.
    pub(super) fn new(kicks: &[f64], drifts: &[f64], rotor: Rotor, bodies: &[RigidBody]) -> Self {
        let stages = kicks.iter().zip(drifts).map(|(&b, &a)| Stage {
            b,
            a,
            turns: Turns::new(bodies.len()),
        });
        Self {
            stages: stages.collect(),
            last_kick: kicks[drifts.len()],
            drift: Drift::new(rotor, bodies),
            loads: vec![Load::default(); bodies.len()],
            next_loads: vec![Load::default(); bodies.len()],
            current: false,
            begun: Backup::of(&[]),
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

impl Splitting {
    /// Moves `states` by a step, all of it or, on an error, a part.
    #[inline]
    fn make(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        let mut report = StepReport::default();
        let mut gravity = &mut self.loads;
        let mut current = self.current || system.is_free();
        for stage in &mut self.stages {
            if stage.b != 0.0 && !current {
                system.loads(states, gravity);
            }
            let kick = Kick {
                gravity: &*gravity,
                controls,
                dt: stage.b * h,
            };
            let iterations = self.drift.apply(
                system.bodies(),
                states,
                &kick,
                &mut stage.turns,
                stage.a * h,
            )?;
            report.iterations = report.iterations.max(iterations);
            gravity = &mut self.next_loads;
            current = system.is_free();
        }
        if self.last_kick != 0.0 && !current {
            system.loads(states, gravity);
        }
        let kick = Kick {
            gravity: &*gravity,
            controls,
            dt: self.last_kick * h,
        };
        if !self.drift.end(states, &kick) {
            check_finite(states)?;
        }
        system.check_clearance(states)?;
        Ok(report)
    }
}

impl Integrator for Splitting {
    fn start(&mut self, system: &mut System, states: &[BodyState]) {
        self.stages
            .iter_mut()
            .for_each(|stage| stage.turns.forget());
        self.begun = Backup::of(states);
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
        self.begun.copy(states);
        let made = self.make(system, states, controls, h);
        if made.is_err() {
            self.begun.restore(states);
            return made;
        }
        for stage in &mut self.stages {
            stage.turns.accept();
        }
        self.current = self.last_kick != 0.0;
        std::mem::swap(&mut self.loads, &mut self.next_loads);
        made
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::*;
    use crate::{Inertia, Method, Simulation};

    /// Two bodies, one of them off its principal axes.
    fn simulation() -> Simulation {
        let turned = lgvi_lie::exp(&Vector3::new(0.3, 0.5, -0.2));
        let j = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 2.5));
        let bodies: Vec<_> = [j, turned * j * turned.transpose()]
            .map(|j| RigidBody::new(1.0, Inertia::new(j).unwrap(), vec![]).unwrap())
            .into();
        let states = bodies.iter().map(|body| {
            let velocity = Vector3::new(0.3, -0.1, 0.2);
            let rate = Vector3::new(1.0, 0.5, -0.75);
            BodyState::from_velocities(body, velocity, velocity, Matrix3::identity(), rate)
        });
        let states = states.collect();
        let method = Method::Lgvi(Rotor::default());
        Simulation::new(System::new(bodies, vec![]), states, method, 0.01).unwrap()
    }

    /// What a failed step has done to the first body, and what it has learnt of both, is undone to the last bit.
    #[test]
    fn failed_steps_leave_no_trace() {
        let none = [Load::default(); 2];
        let second = |moment: f64| {
            let moment = Vector3::new(moment, 0.0, 0.0);
            let force = Vector3::zeros();
            [
                Load {
                    force: moment,
                    moment: force,
                },
                Load { force, moment },
            ]
        };
        let (mut failing, mut smooth) = (simulation(), simulation());
        for step in 0..100 {
            if step % 10 == 3 {
                let error = failing.advance(&second(1e6)).unwrap_err();
                assert!(matches!(error, StepError::Unsolvable { body: 1, .. }));
                let error = failing.advance(&second(f64::NAN)).unwrap_err();
                assert!(!matches!(error, StepError::CloseApproach(_)), "{error}");
            }
            let report = failing.advance(&none).unwrap();
            assert_eq!(report, smooth.advance(&none).unwrap());
            assert_eq!(failing.states(), smooth.states());
            // After six steps to extrapolate from, one solution of the scalar equation is enough.
            assert!(
                step < 6 || report.iterations == 1,
                "step {step}: {report:?}"
            );
        }
    }
}
