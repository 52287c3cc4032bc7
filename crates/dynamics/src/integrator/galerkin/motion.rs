use super::basis::Basis;
use super::curve::{Curve, Guess};
use super::iteration::{Progress, Stall, iterate};
use super::rotation::RotationPath;
use super::translation::TranslationPath;
use crate::{BodyState, Load, Mobility, RigidBody, System};

/// Limit of passes.
const MAX_PASSES: u32 = 40;

/// Limit of halvings in the search for a step that converges from constant velocities.
const MAX_HALVINGS: u32 = 5;

/// The input of a step.
#[derive(Clone, Copy)]
pub(super) struct Step<'a> {
    pub(super) states: &'a [BodyState],
    pub(super) controls: &'a [Load],
    pub(super) h: f64,
}

impl Step<'_> {
    fn halved(self, times: u32) -> Self {
        Self {
            h: self.h / f64::from(1_u32 << times),
            ..self
        }
    }
}

/// The motion of all bodies within a step: their unknowns, and the equations coupled by the loads.
pub(super) struct Motion {
    pub(super) basis: Basis,
    pub(super) rotations: Vec<Option<RotationPath>>,
    pub(super) translations: Vec<Option<TranslationPath>>,
    /// Poses at the quadrature nodes, ordered by node, then by body.
    poses: Vec<BodyState>,
    /// Loads at these poses, in the same order.
    loads: Vec<Load>,
}

impl Motion {
    pub(super) fn new(basis: Basis, bodies: &[RigidBody]) -> Self {
        let turns =
            |body: &RigidBody| matches!(body.mobility(), Mobility::Free | Mobility::Pivoted);
        let glides = |body: &RigidBody| *body.mobility() == Mobility::Free;
        Self {
            rotations: bodies
                .iter()
                .map(|body| turns(body).then(|| RotationPath::new(&basis)))
                .collect(),
            translations: bodies
                .iter()
                .map(|body| glides(body).then(|| TranslationPath::new(&basis)))
                .collect(),
            poses: Vec::with_capacity(basis.points * bodies.len()),
            loads: vec![Load::default(); basis.points * bodies.len()],
            basis,
        }
    }

    /// Computes the initial guess of the unknowns and places the driven bodies on their prescribed paths.
    pub(super) fn begin(&mut self, bodies: &[RigidBody], step: Step<'_>, guess: Guess) {
        let Step { states, h, .. } = step;
        self.poses.clear();
        for node in &self.basis.nodes {
            for (body, state) in bodies.iter().zip(states) {
                self.poses.push(match body.mobility() {
                    Mobility::Driven(drive) => drive.advance(body, state, node * h),
                    _ => *state,
                });
            }
        }
        for (index, (body, state)) in bodies.iter().zip(states).enumerate() {
            if let Some(rotation) = &mut self.rotations[index] {
                rotation.guess(&self.basis, &(h * state.angular_velocity(body)), guess);
            }
            if let Some(translation) = &mut self.translations[index] {
                translation.curve.base = state.position.norm();
                translation.guess(&self.basis, &(h * state.velocity(body)), guess);
            }
        }
    }

    /// Solves the equations. If the iteration does not converge from the first guess, shorter steps from the same
    /// states are solved, and each solution is the initial guess for a step of twice the length.
    pub(super) fn solve(
        &mut self,
        system: &mut System,
        step: Step<'_>,
        guess: Guess,
    ) -> Result<u32, Stall> {
        let mut iterations = 0;
        let mut made = self.attempt(system, step, guess, &mut iterations);
        if made.is_err() {
            let started = (1..=MAX_HALVINGS).find(|&halvings| {
                let shorter = step.halved(halvings);
                let made = self.attempt(system, shorter, Guess::Uniform, &mut iterations);
                made.is_ok()
            });
            for halvings in (0..started.unwrap_or(0)).rev() {
                self.remember();
                let longer = step.halved(halvings);
                made = self.attempt(system, longer, Guess::Stretched, &mut iterations);
                if made.is_err() {
                    break;
                }
            }
        }
        made.map(|()| iterations).map_err(|residual| Stall {
            iterations,
            residual,
        })
    }

    /// Solves the equations from an initial guess, with a Jacobian that omits the derivatives of the loads.
    fn attempt(
        &mut self,
        system: &mut System,
        step: Step<'_>,
        guess: Guess,
        iterations: &mut u32,
    ) -> Result<(), f64> {
        self.begin(system.bodies(), step, guess);
        iterate(MAX_PASSES, iterations, |linearize| {
            self.correct(system, step, linearize);
            let all = curves(&mut self.rotations, &mut self.translations);
            all.map(Curve::advance)
                .fold(Progress::default(), Progress::and)
        })
    }

    /// Computes the corrections of all bodies.
    fn correct(&mut self, system: &mut System, step: Step<'_>, linearize: bool) {
        let Step {
            states,
            controls,
            h,
        } = step;
        let count = states.len().max(1);
        let basis = &self.basis;
        for (index, (body, state)) in system.bodies().iter().zip(states).enumerate() {
            let poses = self.poses[index..].iter_mut().step_by(count);
            if let Some(rotation) = &mut self.rotations[index] {
                rotation.sample(basis, body.inertia());
                let center = state.attitude * rotation.center(basis);
                for (point, pose) in poses.enumerate() {
                    pose.attitude = center * rotation.relative(point);
                    if let Some(translation) = &self.translations[index] {
                        pose.position = state.position + translation.at(basis, point);
                    }
                }
            }
        }
        let nodes = self.poses.chunks_exact(count);
        for (poses, loads) in nodes.zip(self.loads.chunks_exact_mut(count)) {
            system.loads(poses, loads);
            for (load, control) in loads.iter_mut().zip(controls) {
                *load += *control;
            }
        }
        for (index, (body, state)) in system.bodies().iter().zip(states).enumerate() {
            let load = |point: usize| &self.loads[point * count + index];
            if let Some(rotation) = &mut self.rotations[index] {
                rotation.correct(
                    basis,
                    body.inertia(),
                    &state.angular_momentum,
                    h,
                    |point| load(point).moment,
                    linearize,
                );
            }
            if let Some(translation) = &mut self.translations[index] {
                let scale = h * h / body.mass();
                let way = h * state.velocity(body);
                translation.correct(basis, &way, |point| scale * load(point).force);
            }
        }
    }

    /// The loads on a body at the quadrature nodes.
    pub(super) fn loads_on(&self, body: usize) -> impl Iterator<Item = &Load> {
        self.loads.iter().skip(body).step_by(self.rotations.len())
    }

    /// Stores the current motion for later guesses.
    pub(super) fn remember(&mut self) {
        curves(&mut self.rotations, &mut self.translations).for_each(Curve::remember);
    }
}

/// The unknowns of all bodies.
fn curves<'a>(
    rotations: &'a mut [Option<RotationPath>],
    translations: &'a mut [Option<TranslationPath>],
) -> impl Iterator<Item = &'a mut Curve> {
    let rotations = rotations.iter_mut().flatten().map(|path| &mut path.curve);
    let translations = translations.iter_mut().flatten();
    rotations.chain(translations.map(|path| &mut path.curve))
}
