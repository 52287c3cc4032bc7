//! Splittings into Kepler's motion and its perturbation.

mod center;
mod frame;
mod jacobi;
mod kepler;
mod kinds;
mod stumpff;

use nalgebra::Vector3;

use self::frame::Frame;
use super::coefficients::{ABA_82, ABA_864, ABA_1064, LEAPFROG, Scheme};
use super::{
    Integrator, KeplerScheme, MethodError, StepError, StepReport, check_finite, drift::kick,
};
use crate::rotation::FreeRotation;
use crate::{BodyState, Load, Mobility, System};

/// Name of the method in errors.
const NAME: &str = "Wisdom–Holman";

/// Greatest ratio of the perturbation to the attraction of the center at the start.
const PERTURBATION: f64 = 0.5;

/// Drifts along Kepler's motion and the free rotation, both exact, and kicks by what remains of gravity: `H = A + B`,
/// where A is the kinetic energy and the attraction of the centers, and B the rest of the potential.
///
/// The center of all free bodies is the strongest of the fixed sources, fixed bodies and free bodies. About a fixed
/// center each body has a Kepler motion of its own. If the center is a free body, they are taken in Jacobi coordinates,
/// which for two bodies are the relative ones. The free rotation commutes with Kepler's motion, and B depends on the
/// configuration only, so that a kick is one evaluation of forces and moments.
///
/// Every step is symplectic and time-reversible and conserves total linear and angular momentum under mutual gravity to
/// rounding. Its error is proportional to the perturbation; a single point of mass about a point moves exactly in steps
/// of any length.
///
/// # Assumptions and limitations
/// The perturbation is at most half of the attraction of the center at the start, which is checked once. A close
/// approach of two bodies neither of which is the center of the other is as accurate as in a method without Kepler's
/// motion. A pass of the center within a step is followed, but whether it enters the radius of the center is checked at
/// the end of the step only. Pivoted bodies are not supported.
pub struct WisdomHolman {
    /// Coefficients of each kick and of the drift after it.
    stages: Vec<[f64; 2]>,
    last_kick: f64,
    frame: Frame,
    rotations: Vec<FreeRotation>,
    /// What is known of the gravity of the system, once it has been asked for.
    kinds: Option<kinds::Kinds>,
    /// The perturbation at the beginning of the step, and whether it is known.
    perturbation: Vec<Load>,
    known: bool,
    /// The perturbation later in the step.
    later: Vec<Load>,
    begun: Vec<BodyState>,
}

impl WisdomHolman {
    /// Creates the method for `system`.
    ///
    /// # Errors
    /// Returns an error if there is no center or a body is pivoted.
    pub fn new(scheme: KeplerScheme, system: &System) -> Result<Self, MethodError> {
        let scheme = coefficients(scheme);
        let stages = scheme.kicks.iter().zip(&scheme.drifts);
        let bodies = system.bodies();
        let none = vec![Load::default(); bodies.len()];
        Ok(Self {
            stages: stages.map(|(&kick, &drift)| [kick, drift]).collect(),
            last_kick: scheme.kicks[scheme.drifts.len()],
            frame: Frame::of(system)?,
            rotations: bodies
                .iter()
                .map(|body| FreeRotation::new(body.inertia()))
                .collect(),
            kinds: None,
            perturbation: none.clone(),
            known: false,
            later: none,
            begun: Vec::with_capacity(bodies.len()),
        })
    }

    /// The numbers of gravity evaluations and of Kepler's motions of a body in a step.
    pub(crate) fn work(scheme: KeplerScheme) -> (u32, u32) {
        let scheme = coefficients(scheme);
        let kicks = scheme.kicks.iter().filter(|kick| **kick != 0.0).count();
        let shared = scheme.kicks[0] != 0.0 && scheme.kicks[scheme.drifts.len()] != 0.0;
        let evaluations = kicks - usize::from(shared);
        (evaluations as u32, scheme.drifts.len() as u32)
    }

    /// Once started, returns whether Kepler's motion is all there is, and for each body whether no moment ever acts on
    /// it.
    pub(crate) fn outline(&self) -> Option<(bool, &[bool])> {
        let kinds = self.kinds.as_ref()?;
        Some((kinds.solved, &kinds.coasting))
    }

    /// Kicks `states` by the perturbation and the controls over `dt`. `begins` is true for the kick that begins a step.
    #[inline]
    fn kick(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        (dt, begins): (f64, bool),
    ) {
        if dt == 0.0 {
            return;
        }
        if !self.kinds.as_ref().is_some_and(|kinds| kinds.solved) {
            let loads = if begins {
                &mut self.perturbation
            } else {
                &mut self.later
            };
            if !(begins && self.known) {
                system.loads(states, loads);
                self.frame.subtract(system, states, loads);
            }
            kick(system.bodies(), states, loads, dt);
        }
        kick(system.bodies(), states, controls, dt);
    }

    /// Moves `states` by `time`, and rotates the bodies on which no moment acts by `turning`.
    #[inline]
    fn drift(
        &mut self,
        system: &System,
        states: &mut [BodyState],
        [time, turning]: [f64; 2],
        controlled: bool,
    ) -> Result<(), StepError> {
        self.frame.drift(system, states, time)?;
        let known = self.kinds.as_ref().map_or(&[][..], |kinds| &kinds.coasting);
        let coasting = match system.coasting() {
            [] => known,
            coasting => coasting,
        };
        let bodies = system.bodies().iter().zip(&self.rotations);
        for (index, ((body, rotation), state)) in bodies.zip(states).enumerate() {
            match body.mobility() {
                Mobility::Free => {
                    let coasts = !controlled && coasting.get(index).is_some_and(|coasts| *coasts);
                    let turning = if coasts { turning } else { time };
                    let (r, p) = (state.attitude, state.angular_momentum);
                    if turning != 0.0 && p != Vector3::zeros() {
                        let end = (&mut state.attitude, &mut state.angular_momentum);
                        rotation.carry(&r, &p, turning, end);
                    }
                }
                Mobility::Driven(drive) => *state = drive.advance(body, state, time),
                Mobility::Fixed | Mobility::Pivoted => {}
            }
        }
        Ok(())
    }
}

fn coefficients(scheme: KeplerScheme) -> Scheme {
    match scheme {
        KeplerScheme::Leapfrog => LEAPFROG.scheme(),
        KeplerScheme::Aba82 => ABA_82.scheme(),
        KeplerScheme::Aba864 => ABA_864.scheme(),
        KeplerScheme::Aba1064 => ABA_1064.scheme(),
    }
}

impl Integrator for WisdomHolman {
    fn check(&mut self, system: &mut System, states: &[BodyState]) -> Result<(), MethodError> {
        self.frame.order(states);
        self.known = false;
        system.loads(states, &mut self.later);
        self.perturbation.copy_from_slice(&self.later);
        self.frame.subtract(system, states, &mut self.perturbation);
        let center = match &self.frame {
            Frame::Center(_) => None,
            Frame::Jacobi(jacobi) => Some(jacobi.center()),
        };
        for (body, (rest, whole)) in self.perturbation.iter().zip(&self.later).enumerate() {
            let free = *system.bodies()[body].mobility() == Mobility::Free;
            let ratio = rest.force.norm() / (whole.force - rest.force).norm();
            if free && Some(body) != center && ratio > PERTURBATION {
                return Err(MethodError::Perturbation {
                    method: NAME,
                    body,
                    ratio,
                    limit: PERTURBATION,
                });
            }
        }
        Ok(())
    }

    fn start(&mut self, system: &mut System, states: &[BodyState]) {
        if self.kinds.is_none() {
            self.kinds = Some(kinds::Kinds::of(system, &self.frame));
        }
        self.frame.order(states);
        self.known = false;
    }

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        let mut begun = std::mem::take(&mut self.begun);
        states.clone_into(&mut begun);
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
        next.copy_from_slice(states);
        let controlled = controls.iter().any(Load::acts);
        let controls = if controlled { controls } else { &[] };
        for index in 0..self.stages.len() {
            let [kick, drift] = self.stages[index];
            self.kick(system, next, controls, (kick * h, index == 0));
            self.known |= index == 0 && kick != 0.0;
            // A body on which no moment acts rotates once in a step.
            let turning = if index == 0 { h } else { 0.0 };
            self.drift(system, next, [drift * h, turning], controlled)?;
        }
        self.kick(system, next, controls, (self.last_kick * h, false));
        check_finite(next)?;
        system.check_clearance(next)?;
        if self.last_kick != 0.0 {
            std::mem::swap(&mut self.perturbation, &mut self.later);
        }
        Ok(StepReport::default())
    }
}
