//! Lockstep with a controller from outside: the flight waits for its command at the beginning of each control period.

use std::time::{Duration, Instant};

use lgvi_middleware::Parameters;
use lgvi_middleware::node::NodeError;
use lgvi_scene::Scene;
use tracing::warn;

use crate::node::command::Command;
use crate::node::timeouts::Timeouts;
use crate::target::Actuators;
use crate::target::Target;

/// The control periods of a flight in lockstep.
pub(crate) struct Cycle {
    /// Whose commands are waited for.
    targets: Vec<Target>,
    /// Steps in a control period.
    every: u64,
    deadline: Duration,
    /// The step that is waited at, since when, and what is missing.
    wait: Option<(u64, Instant, Vec<Target>)>,
    /// The step whose commands have all come, or whose deadline has passed.
    passed: Option<u64>,
    /// For which no command has come yet: the first one for each has no deadline.
    unheard: Vec<Target>,
    /// For which the last command has come over ROS 2, if any has.
    over_ros: Vec<Target>,
    /// It has been said that the first ones are waited for.
    told: bool,
}

/// How long the answer of a controller on this host is looked for without a pause.
const PROMPT: Duration = Duration::from_micros(200);

/// How long the first command is waited for in silence.
const SILENCE: Duration = Duration::from_secs(5);

impl Cycle {
    /// That of the node's parameters, for a flight that takes wrenches on `wrenches`; `None` where no body is to be
    /// waited for.
    pub(crate) fn read(
        parameters: &Parameters,
        scene: &Scene,
        wrenches: &[usize],
    ) -> Result<Option<Self>, NodeError> {
        let on_bodies = named(parameters, scene, "await_wrench", |index| {
            wrenches.contains(&index)
        })?;
        let mut targets: Vec<_> = on_bodies.into_iter().map(Target::Body).collect();
        for (parameter, actuators) in [
            ("await_wheels", Actuators::Wheels),
            ("await_thrust", Actuators::Thrusters),
        ] {
            let bodies = named(parameters, scene, parameter, |index| {
                wrenches.contains(&index) && !actuators.of(scene, index).is_empty()
            })?;
            let each = bodies.into_iter();
            targets.extend(each.map(|body| Target::Actuators(actuators, body)));
        }
        if targets.is_empty() {
            return Ok(None);
        }
        let period: f64 = parameters.get("control_period")?;
        let deadline: f64 = parameters.get("control_deadline")?;
        let step = scene.seconds(1);
        let every = (period / step).round();
        if every < 1.0 || (period - every * step).abs() > 1e-9 * period {
            return Err(NodeError::Input(format!(
                "parameter \"control_period\" is {period} s, expected a whole number of the scene's steps of {step} s"
            )));
        }
        Ok(Some(Self {
            unheard: targets.clone(),
            over_ros: targets.clone(),
            targets,
            every: every as u64,
            deadline: Duration::try_from_secs_f64(deadline).unwrap_or(Duration::MAX),
            wait: None,
            passed: None,
            told: false,
        }))
    }

    /// Steps in a control period.
    pub(crate) fn every(&self) -> u64 {
        self.every
    }

    /// Whether it has just begun to wait: its answer is then looked for without a pause.
    pub(crate) fn is_prompt(&self) -> bool {
        let since = self.wait.as_ref().map(|(_, since, _)| *since);
        since.is_some_and(|since| since.elapsed() < PROMPT)
    }

    /// Whether a controller has yet to be heard of.
    pub(crate) fn is_silent(&self) -> bool {
        !self.unheard.is_empty()
    }

    /// Whether all controllers answer over shared memory, as far as is known.
    pub(crate) fn is_in_memory(&self) -> bool {
        self.over_ros.is_empty()
    }

    /// Whether a sequence for a target that begins at this step answers its state.
    pub(crate) fn awaits(&self, step: u64, target: Target) -> bool {
        self.begins_at(step) && self.targets.contains(&target)
    }

    /// Whether the state of this step is one that a controller answers.
    pub(crate) fn begins_at(&self, step: u64) -> bool {
        step.is_multiple_of(self.every)
    }

    /// Whether a command answers the state of this step, by its stamp.
    pub(crate) fn admits(&self, scene: &Scene, step: u64, command: &Command) -> bool {
        !self.targets.contains(&command.target())
            || self.begins_at(step) && command.stamp() == scene.stamp(step)
    }

    /// A command for a target has been taken at a step, over shared memory or over ROS 2.
    pub(crate) fn note(&mut self, step: u64, target: Target, in_memory: bool) {
        if !self.targets.contains(&target) {
            return;
        }
        let known = self.over_ros.iter().position(|other| *other == target);
        match known {
            Some(index) if in_memory => drop(self.over_ros.remove(index)),
            None if !in_memory => self.over_ros.push(target),
            _ => {}
        }
        if let Some((_, missing)) = self.wait_at(step) {
            missing.retain(|other| *other != target);
        }
        if self.is_silent() {
            self.unheard.retain(|other| *other != target);
            // From here on there is a deadline.
            if let Some((_, since, _)) = &mut self.wait {
                *since = Instant::now();
            }
        }
    }

    /// Since when this step is waited at, and what is missing; `None` if it is not.
    fn wait_at(&mut self, step: u64) -> Option<(Instant, &mut Vec<Target>)> {
        if !self.begins_at(step) || self.passed == Some(step) {
            return None;
        }
        if self.wait.as_ref().is_none_or(|(at, ..)| *at != step) {
            self.wait = Some((step, Instant::now(), self.targets.clone()));
        }
        let (_, since, missing) = self.wait.as_mut()?;
        Some((*since, missing))
    }

    /// Whether the flight waits at this step; what has missed its deadline is counted.
    pub(crate) fn waits(&mut self, scene: &Scene, step: u64, timeouts: &mut Timeouts) -> bool {
        let (silent, told, deadline) = (self.is_silent(), self.told, self.deadline);
        let Some((since, missing)) = self.wait_at(step) else {
            return false;
        };
        let waited = since.elapsed();
        if !missing.is_empty() && (silent || waited < deadline) {
            if silent && !told && waited >= SILENCE {
                let first = missing.iter().map(|target| target.describe(scene));
                let first = first.collect::<Vec<_>>().join(", ");
                warn!("waiting at step {step} for the first {first}");
                self.told = true;
            }
            return true;
        }
        missing.iter().for_each(|target| timeouts.miss(*target));
        if let Some(target) = missing.first() {
            let what = target.describe(scene);
            warn!(
                "no {what} with the stamp of step {step} came within {deadline:?}: the flight goes on"
            );
        }
        self.wait = None;
        self.passed = Some(step);
        false
    }

    /// The present state has been replaced by another one, which is to be answered, too.
    pub(crate) fn ask_again(&mut self) {
        self.wait = None;
        self.passed = None;
    }

    /// The flight begins anew.
    pub(crate) fn begin_anew(&mut self) {
        self.ask_again();
        self.unheard.clone_from(&self.targets);
        self.over_ros.clone_from(&self.targets);
    }
}

/// The bodies that a parameter names, which must be among those that are `known`.
fn named(
    parameters: &Parameters,
    scene: &Scene,
    parameter: &str,
    known: impl Fn(usize) -> bool,
) -> Result<Vec<usize>, NodeError> {
    let names: Vec<String> = parameters.get(parameter)?;
    let each = names.iter().map(|name| {
        let index = scene.body_index(name).filter(|index| known(*index));
        index.ok_or_else(|| {
            let bodies = scene.bodies.iter().enumerate();
            let known = bodies.filter(|(index, _)| known(*index));
            let known: Vec<_> = known.map(|(_, body)| body.name.as_str()).collect();
            NodeError::Input(format!(
                "parameter {parameter:?} contains {name:?}, expected bodies that take such commands: {}",
                known.join(", ")
            ))
        })
    });
    each.collect()
}
