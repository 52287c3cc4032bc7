use nalgebra::Vector3;

use super::drift::{Coasting, Drift, end};
use super::{Integrator, Rotor, StepError, StepReport, check_finite};
use crate::{BodyState, Load, RigidBody, System};

/// Alternating kicks and drifts: `K(b₀h) D(a₀h) K(b₁h) … D(a_{s−1}h) K(b_s h)`.
///
/// A kick K changes the momenta by gravity and controls at fixed configuration. A drift D is the free motion of all
/// bodies, with rotations computed by a [`Rotor`]. Both conserve total linear and angular momentum under mutual
/// gravity, and both are symplectic, and therefore so is the whole method. The loads at the end of a step are reused at
/// the start of the next.
///
/// # Assumptions and limitations
/// The discrete rotor solves an implicit equation that has a solution only up to about 90° per drift. Beyond it, the
/// step returns [`StepError::Unsolvable`].
pub struct Splitting {
    /// Coefficients of kicks and drifts, each drift after its kick.
    stages: Vec<KickDrift>,
    /// Coefficient of the kick after all drifts.
    last_kick: f64,
    loads: Loads,
    drift: Drift,
    /// Second buffer for the states between the stages of a step.
    between: Vec<BodyState>,
    /// States at the beginning of the current step.
    begun: Vec<BodyState>,
    /// True if a body without moments rotates once per step, in the first drift.
    once: bool,
    /// True if one of these bodies is at rest.
    rests: bool,
}

/// A kick `K(bh)`, followed by a drift `D(ah)`.
#[derive(Clone, Copy)]
struct KickDrift {
    b: f64,
    a: f64,
}

impl Splitting {
    /// Creates a splitting with the coefficients `b` of the kicks, one more than the coefficients `a` of the drifts.
    pub(super) fn new(kicks: &[f64], drifts: &[f64], rotor: Rotor, bodies: &[RigidBody]) -> Self {
        let stages = kicks.iter().zip(drifts).map(|(&b, &a)| KickDrift { b, a });
        Self {
            once: rotor == Rotor::Exact && drifts.len() > 1,
            stages: stages.collect(),
            last_kick: kicks[drifts.len()],
            loads: Loads::new(bodies.len()),
            drift: Drift::new(rotor, bodies, drifts.len()),
            between: Vec::new(),
            begun: Vec::new(),
            rests: false,
        }
    }

    /// The Lie group variational integrator in Hamiltonian form, (3.22)–(3.26). It is of second order, symplectic and
    /// time-reversible, with one gravity evaluation per step.
    ///
    /// A step consists of half a kick, a drift and half a kick. With `p = Π_k + (h/2) M_k`, (3.24) is `h S(p) = F J_d −
    /// J_d Fᵀ` and (3.25) is `Π_{k+1} = Fᵀ p + (h/2) M_{k+1}`. (3.22) and (3.23) correspond to them for the position.
    pub fn lgvi(rotor: Rotor, bodies: &[RigidBody]) -> Self {
        Self::new(&[0.5, 0.5], &[1.0], rotor, bodies)
    }

    /// The Lie–Euler method, (4.19)–(4.23), of first order with one gravity evaluation per step. The discrete optimal
    /// control problem is formulated with it. A step is a drift followed by a kick with the loads at its end, so a
    /// control acts as an impulse at the end of the step.
    pub fn lie_euler(rotor: Rotor, bodies: &[RigidBody]) -> Self {
        Self::new(&[0.0, 1.0], &[1.0], rotor, bodies)
    }

    /// The coefficients of each kick and the following drift, and the coefficient of the last kick.
    pub(crate) fn coefficients(&self) -> (Vec<(f64, f64)>, f64) {
        let stages = self.stages.iter().map(|stage| (stage.b, stage.a));
        (stages.collect(), self.last_kick)
    }

    /// The numbers of gravity evaluations and drifts per step.
    pub(crate) fn work(&self) -> (u32, u32) {
        let acts = |b: f64| u32::from(b != 0.0);
        let kicks: u32 = self.stages.iter().map(|stage| acts(stage.b)).sum();
        let first = self.stages.first().map_or(0, |stage| acts(stage.b));
        let last = acts(self.last_kick);
        (kicks + last - first * last, self.stages.len() as u32)
    }
}

/// The loads on the bodies.
struct Loads {
    /// Gravity at the beginning of the step.
    gravity: Vec<Load>,
    /// True if this gravity has been computed.
    known: bool,
    /// Gravity later in the step.
    later: Vec<Load>,
    /// Sum of gravity and controls.
    total: Vec<Load>,
}

impl Loads {
    fn new(bodies: usize) -> Self {
        let none = vec![Load::default(); bodies];
        Self {
            gravity: none.clone(),
            known: false,
            later: none.clone(),
            total: none,
        }
    }

    /// The loads at `states` (one per body) for a kick with coefficient `b`, or an empty slice if nothing acts.
    /// `begins` is true if the kick begins the step.
    #[inline(always)]
    fn at<'a>(
        &'a mut self,
        system: &mut System,
        states: &[BodyState],
        controls: &'a [Load],
        (b, begins): (f64, bool),
    ) -> &'a [Load] {
        if b == 0.0 {
            return &[];
        }
        if system.is_free() {
            return controls;
        }
        let gravity = if begins {
            &mut self.gravity
        } else {
            &mut self.later
        };
        if !(begins && self.known) {
            system.loads(states, gravity);
        }
        if controls.is_empty() {
            return gravity;
        }
        for ((total, &gravity), &control) in self.total.iter_mut().zip(&*gravity).zip(controls) {
            *total = gravity + control;
        }
        &self.total
    }

    /// Accepts the step. `known` is true if it ended with a kick.
    #[inline(always)]
    fn accept(&mut self, known: bool) {
        std::mem::swap(&mut self.gravity, &mut self.later);
        self.known = known;
    }
}

impl Splitting {
    /// Sets `next` to `states` after one stage. Returns the largest number of Newton corrections of a body.
    #[inline(always)]
    fn stage(
        &mut self,
        system: &mut System,
        (states, next): (&[BodyState], &mut [BodyState]),
        controls: &[Load],
        h: f64,
        index: usize,
    ) -> Result<u32, StepError> {
        let KickDrift { b, a } = self.stages[index];
        let loads = self.loads.at(system, states, controls, (b, index == 0));
        let kick = (loads, b * h);
        let coasting = if (self.once || self.rests) && controls.is_empty() {
            Coasting {
                bodies: system.coasting(),
                time: match (self.once, index) {
                    (false, _) => a * h,
                    (true, 0) => h,
                    (true, _) => 0.0,
                },
            }
        } else {
            Coasting::default()
        };
        let states = (states, next);
        self.drift
            .apply(system.bodies(), states, kick, a * h, index, coasting)
    }

    /// Sets `next` to `states` after all stages, alternating between two buffers.
    fn stages(
        &mut self,
        system: &mut System,
        (states, next): (&[BodyState], &mut [BodyState]),
        controls: &[Load],
        h: f64,
    ) -> Result<u32, StepError> {
        let mut between = std::mem::take(&mut self.between);
        let (mut ahead, mut here) = if self.stages.len() % 2 == 1 {
            (next, between.as_mut_slice())
        } else {
            (between.as_mut_slice(), next)
        };
        let each = (0..self.stages.len()).try_fold(0, |most, index| {
            let states = if index == 0 { states } else { &*here };
            let iterations = self.stage(system, (states, &mut *ahead), controls, h, index)?;
            std::mem::swap(&mut ahead, &mut here);
            Ok(iterations.max(most))
        });
        self.between = between;
        each
    }
}

impl Integrator for Splitting {
    fn start(&mut self, system: &mut System, states: &[BodyState]) {
        self.drift.forget();
        states.clone_into(&mut self.between);
        states.clone_into(&mut self.begun);
        system.loads(states, &mut self.loads.gravity);
        self.loads.known = true;
        let mut each = system.coasting().iter().zip(states);
        self.rests =
            each.any(|(coasts, state)| *coasts && state.angular_momentum == Vector3::zeros());
    }

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        let mut begun = std::mem::take(&mut self.begun);
        begun.copy_from_slice(states);
        let made = self.step_to(system, &begun, states, controls, h);
        if made.is_err() {
            states.copy_from_slice(&begun);
        }
        self.begun = begun;
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
        let acts = controls.iter().any(Load::acts);
        let controls = if acts { controls } else { &[] };
        let iterations = if self.stages.len() == 1 {
            self.stage(system, (states, next), controls, h, 0)?
        } else {
            self.stages(system, (states, next), controls, h)?
        };
        let last = (self.last_kick, false);
        let loads = self.loads.at(system, next, controls, last);
        if !end(system.bodies(), next, (loads, self.last_kick * h)) {
            check_finite(next)?;
        }
        system.check_clearance(next)?;
        self.drift.accept();
        self.loads.accept(self.last_kick != 0.0);
        Ok(StepReport {
            iterations,
            cuts: 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::{Inertia, Method, Simulation};

    /// Two bodies, one of them with axes that are not principal axes.
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

    /// Checks that a failed step leaves no trace: its effect on the first body and the history of both are restored
    /// bitwise.
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
            // After six steps of history, one Newton correction is sufficient.
            assert!(
                step < 6 || report.iterations == 1,
                "step {step}: {report:?}"
            );
        }
    }
}
