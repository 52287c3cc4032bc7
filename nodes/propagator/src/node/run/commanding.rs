//! How the flight's loop takes controls and commands from outside, and waits for them.

use std::time::{Duration, Instant};

use lgvi_middleware::node::{Node, NodeError};
use lgvi_middleware::shm::ShmNode;
use lgvi_scene::Scene;
use tracing::warn;

use super::{Propagator, WAIT};
use crate::node::answers::Answers;
use crate::node::command::Command;
use crate::node::config::Config;
use crate::node::cycle::Cycle;
use crate::node::timeouts::Timeouts;
use crate::node::wrench::Terms;
use crate::target::Target;
use crate::{ControlError, Controls};

/// How often waiting looks whether the answer of a controller has come.
const ANSWER: Duration = Duration::from_micros(20);

/// How often a state is published until its first answer comes.
const PROMPT: Duration = Duration::from_secs(1);

/// The commands of a flight.
pub(super) struct Commanding {
    /// How they act; `None` where none are taken.
    terms: Option<Terms>,
    /// Where the flight waits for a controller.
    cycle: Option<Cycle>,
    /// Where answers come over shared memory; `None` where the flight does not wait.
    answers: Option<Answers>,
    /// Those taken for the present step, by the index of their target.
    latest: Vec<Option<Command>>,
    /// Those that were over before others came.
    pub(super) timeouts: Timeouts,
    /// When the state that is waited at was last published.
    asked: Instant,
}

impl Commanding {
    pub(super) fn new(
        node: &Node,
        shm: &ShmNode,
        scene: &Scene,
        config: &Config,
    ) -> Result<Self, NodeError> {
        let cycle = Cycle::read(&node.parameters, scene, &config.wrenches)?;
        let answers = match &cycle {
            Some(_) => Some(Answers::new(shm, &node.args.resolve("~/answer")?)?),
            None => None,
        };
        let every = cycle.as_ref().map_or(1, Cycle::every);
        Ok(Self {
            terms: config.terms.map(|terms| terms.for_steps(every)),
            cycle,
            answers,
            latest: vec![None; Target::count(scene.bodies.len())],
            timeouts: Timeouts::default(),
            asked: Instant::now(),
        })
    }

    /// Pauses until the answer of a controller is looked for again.
    pub(super) fn pause(&self) {
        let Some(cycle) = &self.cycle else {
            return;
        };
        if cycle.is_silent() {
            std::thread::sleep(WAIT);
        } else if cycle.is_in_memory() && cycle.is_prompt() {
            std::thread::yield_now();
        } else {
            std::thread::sleep(ANSWER);
        }
    }

    /// Whether all controllers that are waited for answer over shared memory.
    pub(super) fn is_in_memory(&self) -> bool {
        self.cycle.as_ref().is_some_and(Cycle::is_in_memory)
    }

    /// Forgets the answers that have come in over shared memory.
    pub(super) fn forget(&mut self) -> Result<(), NodeError> {
        self.answers.as_mut().map_or(Ok(()), Answers::forget)
    }

    /// The flight begins anew.
    pub(super) fn begin_anew(&mut self) {
        if let Some(cycle) = &mut self.cycle {
            cycle.begin_anew();
        }
        self.timeouts = Timeouts::default();
    }
}

impl Propagator {
    /// Accepts or refuses the control sequences that have come in.
    pub(super) fn take_controls(&mut self) {
        while let Some(controls) = self.link.next_controls() {
            let step = self.flight.step();
            let verdict = self.flight.admit(controls).map(|()| step);
            self.accepted += u64::from(verdict.is_ok());
            self.late_controls += u64::from(matches!(verdict, Err(ControlError::Late { .. })));
            self.link.answer(verdict);
        }
    }

    /// Flies the last command for each target that has come in.
    pub(super) fn take_commands(&mut self) -> Result<(), NodeError> {
        let Some(terms) = self.commanding.terms else {
            return Ok(());
        };
        let step = self.flight.step();
        let mut taken = 0;
        while let Some(command) = self.link.next_command(taken) {
            let cycle = self.commanding.cycle.as_ref();
            if cycle.is_none_or(|cycle| cycle.admits(&self.scene, step, &command)) {
                let place =
                    &mut self.commanding.latest[command.target().index(self.scene.bodies.len())];
                taken += usize::from(place.is_none());
                *place = Some(command);
            }
        }
        for index in 0..self.commanding.latest.len() {
            if taken == 0 {
                break;
            }
            let Some(command) = self.commanding.latest[index].take() else {
                continue;
            };
            taken -= 1;
            if let Some(cycle) = &mut self.commanding.cycle {
                cycle.note(step, command.target(), false);
            }
            let first_step = terms.first_step(step);
            if first_step < self.scene.steps {
                self.fly_command(&command, &terms, first_step)?;
            }
        }
        Ok(())
    }

    /// Flies the sequences that answer the present state over shared memory.
    pub(super) fn take_answers(&mut self) -> Result<(), NodeError> {
        let step = self.flight.step();
        let Commanding {
            cycle,
            answers,
            timeouts,
            ..
        } = &mut self.commanding;
        let (Some(cycle), Some(answers)) = (cycle, answers) else {
            return Ok(());
        };
        while self.link.has_room()
            && let Some(answer) = answers.next(&self.scene, step)?
        {
            if cycle.begins_at(step) && !cycle.awaits(step, answer.target) {
                answers.refuse(&format!(
                    "a {} is not waited for at step {step}",
                    answer.target.describe(&self.scene)
                ));
            } else if step < self.scene.steps && cycle.begins_at(step) {
                self.flight
                    .accept(answer.controls)
                    .map_err(NodeError::runtime)?;
                self.accepted += 1;
                timeouts.watch(answer.target);
                self.link.flies(answer.message);
                cycle.note(step, answer.target, true);
            }
        }
        Ok(())
    }

    /// Flies a command from a step on, as the repetition reads it.
    fn fly_command(
        &mut self,
        command: &Command,
        terms: &Terms,
        first_step: u64,
    ) -> Result<(), NodeError> {
        let sequence = command
            .sequence(&self.scene, terms, first_step)
            .map_err(NodeError::runtime)?;
        let controls = Controls::of_message(&self.scene, &sequence).map_err(NodeError::runtime)?;
        self.flight.accept(controls).map_err(NodeError::runtime)?;
        self.accepted += 1;
        self.commanding.timeouts.watch(command.target());
        self.link.flies(sequence);
        Ok(())
    }

    /// Says where the last command for a target is over, at most once a second.
    pub(super) fn note_timeouts(&mut self) {
        let (scene, flight) = (&self.scene, &self.flight);
        let acts = |target: Target| flight.acts(target);
        if let Some(target) = self.commanding.timeouts.note(acts, Instant::now) {
            let (what, step) = (target.describe(scene), flight.step());
            warn!("no new {what}: none acts from step {step} on");
        }
    }

    /// Whether it holds until a controller has answered the present state.
    pub(super) fn waits_for_command(&mut self, node: &Node) -> Result<bool, NodeError> {
        let step = self.flight.step();
        if step == self.scene.steps {
            return Ok(false);
        }
        let Commanding {
            cycle, timeouts, ..
        } = &mut self.commanding;
        let Some(cycle) = cycle else {
            return Ok(false);
        };
        let waited = cycle.waits(&self.scene, step, timeouts);
        if waited && cycle.is_silent() && self.commanding.asked.elapsed() >= PROMPT {
            // Who has come since has not seen it.
            self.commanding.asked = Instant::now();
            self.states.connect()?;
            self.sense_again()?;
            self.link.repeat(&self.flight);
        }
        if waited {
            self.set_pace(node);
        }
        Ok(waited)
    }

    /// Whether a controller is to answer the state of a step.
    pub(crate) fn is_answered(&self, step: u64) -> bool {
        let cycle = self.commanding.cycle.as_ref();
        cycle.is_some_and(|cycle| cycle.begins_at(step))
    }

    /// The states have been replaced: what came in answers others.
    pub(crate) fn ask_again(&mut self) -> Result<(), NodeError> {
        self.link.forget_commands();
        self.commanding.forget()?;
        self.sensors.begin(&self.flight);
        if let Some(cycle) = &mut self.commanding.cycle {
            cycle.ask_again();
        }
        Ok(())
    }

    /// Whether it holds until a plan made on the way has come; what is missed meanwhile is not made up for.
    pub(super) fn waits_for_plan(&mut self, node: &Node) -> bool {
        let Some(lockstep) = &mut self.lockstep else {
            return false;
        };
        let waited = lockstep.waits(&self.flight);
        if waited {
            self.set_pace(node);
        }
        waited
    }
}
