use std::sync::Arc;

use lgvi_dynamics::docking::Docked;
use lgvi_dynamics::{
    ActuatorStates, BodyState, Invariants, Load, MethodError, Simulation, StepError, StepReport,
    System,
};
use lgvi_scene::{ActuatorErrors, Energies, MAX_THRUSTERS, Maneuver, Scene, Scheme, SchemeError};
use thiserror::Error;

use crate::pushes::Pushes;
use crate::target::Actuators;
use crate::target::Target;
use crate::{ControlError, Controls, SetStates};

/// The most sequences that are kept for one body.
const SEQUENCES: usize = 64;

/// The efforts of actuators that nobody commands, of as many as a body can have.
const NO_EFFORTS: [f64; MAX_THRUSTERS] = [0.0; MAX_THRUSTERS];

/// The most memory that the sequences of all bodies may take (byte).
const MEMORY: usize = 512 << 20;

/// A scene on its way under the control sequences accepted so far.
///
/// A sequence acts on its body from its first step on, in place of any accepted before it. What acts in each step is its
/// control, corrected by its feedback law if it has one, with the errors of the scene's disturbance if it has one.
pub struct Flight {
    simulation: Simulation,
    scheme: Scheme,
    /// Substeps above which a step was cut; none where steps are never cut.
    whole: Option<u32>,
    /// Accepted sequences by target, oldest first; those that can no longer act are dropped.
    accepted: Vec<Vec<Arc<Controls>>>,
    pushes: Pushes,
    /// Which body's controls act other than they are meant, and by how much.
    errors: Option<(usize, ActuatorErrors)>,
    loads: Vec<Load>,
    /// The scene's steps.
    steps: u64,
    /// The actuators of all bodies, and how many.
    actuators: Vec<(Actuators, usize, usize)>,
    /// The thrusters or wheels that plans command, and their body.
    planned: Vec<(Actuators, usize)>,
}

/// States that a flight cannot go on from.
#[derive(Debug, Error)]
pub enum SetStatesError {
    /// They are not those of rigid bodies.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// What flies the scene cannot fly them.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// The step from them cannot be made.
    #[error("no step can be made from these states: {0}")]
    Step(String),
    /// A step from them leaves the range of numbers in SI.
    #[error("a step from these states leads to states or an energy that are not finite in SI")]
    Range,
    /// Bodies that are too fast, or at one point.
    #[error("the energy of these states is not finite")]
    Energy,
}

impl Flight {
    /// At step 0 of `scene`.
    pub fn new(scene: &Scene) -> Result<Self, SchemeError> {
        let scheme = scene.scheme()?;
        Ok(Self::of(scene, scheme, scene.simulation(scheme)?))
    }

    /// At the present step of a simulation of `scene` by this scheme, such as one under other gravity.
    pub fn of(scene: &Scene, scheme: Scheme, mut simulation: Simulation) -> Self {
        let bodies = scene.bodies.len();
        scene.disturb_actuators(&mut simulation);
        Self {
            simulation,
            scheme,
            whole: scene.subdivides(scheme).then_some(scheme.substeps),
            // So that accepting a sequence on the way allocates nothing.
            accepted: (0..Target::count(bodies))
                .map(|_| Vec::with_capacity(SEQUENCES))
                .collect(),
            pushes: Pushes::default(),
            errors: scene.actuator_errors(),
            loads: vec![Load::default(); bodies],
            steps: scene.steps,
            actuators: (0..bodies)
                .flat_map(|body| [(Actuators::Wheels, body), (Actuators::Thrusters, body)])
                .map(|(actuators, body)| (actuators, body, actuators.of(scene, body).len()))
                .filter(|(.., count)| *count > 0)
                .collect(),
            planned: (scene.maneuver.iter())
                .flat_map(Maneuver::planned)
                .filter_map(|planned| {
                    Some((Actuators::commanded(planned.commands())?, planned.body))
                })
                .collect(),
        }
    }

    /// The sequences of a body's plans: for itself, or for its thrusters or wheels where its plans command them.
    fn plans(&self, body: usize) -> &[Arc<Controls>] {
        let mut planned = self.planned.iter();
        let target = match planned.find(|(_, planned)| *planned == body) {
            Some((actuators, _)) => Target::Actuators(*actuators, body),
            None => Target::Body(body),
        };
        &self.accepted[target.index(self.loads.len())]
    }

    /// How often an interaction has been taken up in more or in less detail since the last reset.
    pub fn switches(&self) -> u64 {
        self.simulation.switches()
    }

    /// What flies it.
    pub fn scheme(&self) -> Scheme {
        self.scheme
    }

    /// Takes a sequence from outside into account; refuses one that could never act, or that there is no room for.
    pub fn admit(&mut self, controls: impl Into<Arc<Controls>>) -> Result<(), ControlError> {
        let controls = controls.into();
        let (first_step, steps) = (controls.first_step, self.steps);
        self.check_in_time(first_step)?;
        if first_step >= steps {
            return Err(ControlError::Beyond { first_step, steps });
        }
        let channel = self.channel(&controls);
        self.drop_past(channel);
        let replaced = |earlier: &&Arc<Controls>| earlier.first_step >= first_step;
        let channels = self.accepted.iter().enumerate();
        let kept: usize = channels
            .flat_map(|(other, accepted)| {
                let stays = move |earlier: &&Arc<Controls>| other != channel || !replaced(earlier);
                accepted.iter().filter(stays)
            })
            .map(|earlier| earlier.size())
            .sum();
        let accepted = self.accepted[channel].iter();
        if accepted.filter(|earlier| !replaced(earlier)).count() >= SEQUENCES {
            return Err(ControlError::TooMany { limit: SEQUENCES });
        }
        if kept.saturating_add(controls.size()) > MEMORY {
            return Err(ControlError::TooLarge {
                size: controls.size(),
                kept,
                limit: MEMORY,
            });
        }
        self.accept(controls)
    }

    /// Takes a sequence into account; refuses one that would have had to start in the past.
    ///
    /// Sequences that can no longer act are let go of. Their memory is given back here unless somebody else holds them.
    pub fn accept(&mut self, controls: impl Into<Arc<Controls>>) -> Result<(), ControlError> {
        let controls = controls.into();
        let first_step = controls.first_step;
        self.check_in_time(first_step)?;
        let channel = self.channel(&controls);
        self.drop_past(channel);
        let accepted = &mut self.accepted[channel];
        accepted.retain(|earlier| earlier.first_step < first_step);
        accepted.push(controls);
        Ok(())
    }

    /// Lets a load in the scene's units, the force in the inertial frame and the moment in that of the body, act over the next
    /// `steps` steps in addition to everything else that acts on `body`. Errors of actuators do not change it. Nothing happens
    /// if there is no such body.
    pub fn push(&mut self, body: usize, load: Load, steps: u64) {
        let step = self.simulation.step();
        self.pushes
            .add(body, load, [step, step.saturating_add(steps)]);
    }

    /// Which of the accepted sequences a sequence is among: those with its target.
    fn channel(&self, controls: &Controls) -> usize {
        controls.target().index(self.loads.len())
    }

    /// Lets go of the sequences of a channel that others have taken the place of.
    fn drop_past(&mut self, channel: usize) {
        let step = self.simulation.step();
        let accepted = &mut self.accepted[channel];
        let acting = accepted
            .iter()
            .rposition(|earlier| earlier.first_step <= step)
            .unwrap_or(0);
        accepted.drain(..acting);
    }

    fn check_in_time(&self, first_step: u64) -> Result<(), ControlError> {
        let step = self.simulation.step();
        if first_step < step {
            return Err(ControlError::Late { first_step, step });
        }
        Ok(())
    }

    /// Begins anew at step 0, without any sequence.
    pub fn reset(&mut self, scene: &Scene) -> Result<(), SchemeError> {
        self.simulation = scene.simulation(self.scheme)?;
        scene.disturb_actuators(&mut self.simulation);
        self.accepted.iter_mut().for_each(Vec::clear);
        self.pushes.clear();
        self.loads.fill(Load::default());
        Ok(())
    }

    /// Whether a step can be made from other states of some bodies at the present step: it is made on the side.
    ///
    /// # Assumptions and limitations
    /// What may come after that step is not looked at.
    pub fn try_states(&self, scene: &Scene, states: &SetStates) -> Result<(), SetStatesError> {
        let mut all = self.simulation.states().to_vec();
        states.write(&mut all);
        let mut trial = scene.simulation_from(all, self.scheme)?;
        scene.disturb_actuators(&mut trial);
        trial.set_actuator_states(&ActuatorStates::of(self.system()));
        let mut loads = self.loads.clone();
        self.command(&mut loads, trial.states());
        let step = self.step();
        command_actuators(
            &mut trial,
            &self.actuators,
            &self.accepted,
            step,
            &mut loads,
        );
        self.pushes.act(step, &mut loads);
        trial
            .advance(&loads)
            .map_err(|error| SetStatesError::Step(scene.step_error(&error)))?;
        let units = &scene.units;
        let energy = trial.invariants().energy * units.energy();
        let mut states = trial.states().iter();
        if energy.is_finite() && states.all(|state| units.state_to_si(state).is_finite()) {
            Ok(())
        } else {
            Err(SetStatesError::Range)
        }
    }

    /// Goes on from other states of some bodies at the present step; where they cannot be, nothing changes. Bodies that have
    /// docked separate, and dock again where their ports still meet.
    pub fn set_states(&mut self, states: &SetStates) -> Result<(), SetStatesError> {
        let system = self.simulation.system();
        let mut all = self.simulation.states().to_vec();
        states.write(&mut all);
        system.constrain(&mut all);
        if !Invariants::of(system, &all).energy.is_finite() {
            return Err(SetStatesError::Energy);
        }
        Ok(self.simulation.set_states(&all)?)
    }

    /// The dockings that have taken place since the last reset.
    pub fn docked(&self) -> &[Docked] {
        self.simulation.docked()
    }

    /// Whether a sequence has been accepted for `body`, or for its thrusters where its plans command them.
    pub fn commanded(&self, body: usize) -> bool {
        !self.plans(body).is_empty()
    }

    /// Whether a sequence acts on a target in the present step.
    #[cfg(feature = "node")]
    pub(crate) fn acts(&self, target: Target) -> bool {
        let step = self.simulation.step();
        let channel = target.index(self.loads.len());
        let mut latest = self.accepted[channel].iter().rev();
        latest
            .find(|controls| controls.first_step <= step)
            .is_some_and(|controls| step < controls.end())
    }

    /// Whether a sequence of `body` that begins at `step` has been accepted and will act, or acts.
    pub fn has_sequence_from(&self, body: usize, step: u64) -> bool {
        let mut accepted = self.plans(body).iter();
        accepted.any(|controls| controls.first_step == step)
    }

    /// The step at which the sequence of `body` that acts last ends.
    pub fn sequence_end(&self, body: usize) -> Option<u64> {
        Some(self.plans(body).last()?.end())
    }

    /// Makes one step. Allocates nothing.
    pub fn advance(&mut self) -> Result<StepReport, StepError> {
        let mut loads = std::mem::take(&mut self.loads);
        self.command(&mut loads, self.simulation.states());
        let step = self.simulation.step();
        let Self {
            simulation,
            actuators,
            accepted,
            ..
        } = self;
        command_actuators(simulation, actuators, accepted, step, &mut loads);
        self.pushes.act(step, &mut loads);
        let made = self.simulation.advance(&loads);
        let bodies = self.simulation.system().bodies();
        for (load, body) in loads.iter_mut().zip(bodies) {
            if let Some(thrusters) = body.thrusters() {
                load.force += thrusters.engine_force();
            }
        }
        self.loads = loads;
        made
    }

    /// What accepted sequences command in the present step, from these states.
    fn command(&self, loads: &mut [Load], states: &[BodyState]) {
        let step = self.simulation.step();
        for (load, accepted) in loads.iter_mut().zip(&self.accepted) {
            *load = accepted
                .iter()
                .rev()
                .find_map(|controls| controls.at(step, states))
                .unwrap_or_default();
        }
        if let Some((body, errors)) = &self.errors {
            loads[*body] = errors.apply(&loads[*body]);
        }
    }

    /// Into how many steps one with this report was cut because it could not be made as one; `None` where it could.
    pub fn cut(&self, report: StepReport) -> Option<u32> {
        self.whole
            .is_some_and(|whole| report.cuts > whole)
            .then_some(report.cuts)
    }

    /// What acted on the bodies in the last step, beside gravity.
    pub fn loads(&self) -> &[Load] {
        &self.loads
    }

    /// The bodies and their gravity.
    pub fn system(&self) -> &System {
        self.simulation.system()
    }

    /// The bodies that have used all their propellant.
    pub fn exhausted(&self) -> impl Iterator<Item = usize> {
        let bodies = self.system().bodies().iter().enumerate();
        let exhausted = bodies.filter(|(_, body)| {
            let thrusters = body.thrusters();
            thrusters.is_some_and(|own| own.propellant().mass > 0.0 && own.propellant_left() == 0.0)
        });
        exhausted.map(|(body, _)| body)
    }

    /// The bodies' states.
    pub fn states(&self) -> &[BodyState] {
        self.simulation.states()
    }

    /// Steps made.
    pub fn step(&self) -> u64 {
        self.simulation.step()
    }

    /// The energies of the present states, in the scene's units.
    pub fn energies(&self) -> Energies {
        Energies::of(self.simulation.system(), self.simulation.states())
    }

    /// The invariants of the present states, in the scene's units.
    pub fn invariants(&self) -> Invariants {
        self.simulation.invariants()
    }
}

/// Commands the actuators of a simulation for its next step, which is this one of the flight. `accepted` are the sequences by
/// target. What engines exert is taken out of the loads.
fn command_actuators(
    simulation: &mut Simulation,
    all: &[(Actuators, usize, usize)],
    accepted: &[Vec<Arc<Controls>>],
    step: u64,
    loads: &mut [Load],
) {
    let bodies = simulation.states().len();
    for &(actuators, body, count) in all {
        let channel = Target::Actuators(actuators, body).index(bodies);
        let mut efforts = NO_EFFORTS;
        let efforts = &mut efforts[..count];
        let state = &simulation.states()[body];
        let mut latest = accepted[channel].iter().rev();
        latest.find(|controls| controls.command(step, state, efforts));
        match actuators {
            Actuators::Wheels => simulation.set_wheel_commands(body, efforts),
            Actuators::Thrusters => simulation.set_thruster_commands(body, efforts),
        }
    }
    for (body, load) in loads.iter_mut().enumerate() {
        *load = simulation.command(body, *load);
    }
}

#[cfg(test)]
pub(crate) mod tests;
