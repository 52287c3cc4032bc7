//! Lockstep with a controller from outside: the flight waits for its command at the beginning of each control period.

use std::time::{Duration, Instant};

use lgvi_middleware::Parameters;
use lgvi_middleware::node::NodeError;
use lgvi_scene::Scene;
use tracing::warn;

use crate::wrench::Wrench;

/// The control periods of a flight in lockstep.
pub(crate) struct Cycle {
    /// The bodies whose wrenches are waited for.
    bodies: Vec<usize>,
    /// Steps in a control period.
    every: u64,
    deadline: Duration,
    /// The step that is waited at, since when, and the bodies that are missing.
    wait: Option<(u64, Instant, Vec<usize>)>,
    /// The step whose commands have all come, or whose deadline has passed.
    passed: Option<u64>,
    /// The bodies on which no wrench has come yet: the first one on each has no deadline.
    unheard: Vec<usize>,
    /// It has been said that the first ones are waited for.
    told: bool,
}

/// How long the first wrench is waited for in silence.
const SILENCE: Duration = Duration::from_secs(5);

impl Cycle {
    /// That of the node's parameters, for a flight that takes wrenches on `wrenches`; `None` where no body is to be
    /// waited for.
    pub(crate) fn read(
        parameters: &Parameters,
        scene: &Scene,
        wrenches: &[usize],
    ) -> Result<Option<Self>, NodeError> {
        let names: Vec<String> = parameters.get("await_wrench")?;
        if names.is_empty() {
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
        let bodies = names.iter().map(|name| {
            let index = scene.body_index(name);
            index.filter(|index| wrenches.contains(index)).ok_or_else(|| {
                let known = wrenches.iter().map(|body| scene.bodies[*body].name.as_str());
                let known: Vec<_> = known.collect();
                NodeError::Input(format!(
                    "parameter \"await_wrench\" contains {name:?}, expected bodies on which wrenches are taken: {}",
                    known.join(", ")
                ))
            })
        });
        let bodies: Vec<usize> = bodies.collect::<Result<_, _>>()?;
        Ok(Some(Self {
            unheard: bodies.clone(),
            bodies,
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

    /// Whether a controller has yet to be heard of.
    pub(crate) fn is_silent(&self) -> bool {
        !self.unheard.is_empty()
    }

    /// Whether the state of this step is one that a controller answers.
    pub(crate) fn begins_at(&self, step: u64) -> bool {
        step.is_multiple_of(self.every)
    }

    /// Whether a wrench answers the state of this step, by its stamp.
    pub(crate) fn admits(&self, scene: &Scene, step: u64, wrench: &Wrench) -> bool {
        !self.bodies.contains(&wrench.body)
            || self.begins_at(step) && wrench.stamp == scene.stamp(step)
    }

    /// A wrench has been taken at a step.
    pub(crate) fn note(&mut self, step: u64, body: usize) {
        if let Some((_, missing)) = self.wait_at(step) {
            missing.retain(|other| *other != body);
        }
        if self.is_silent() {
            self.unheard.retain(|other| *other != body);
            // From here on there is a deadline.
            if let Some((_, since, _)) = &mut self.wait {
                *since = Instant::now();
            }
        }
    }

    /// Since when this step is waited at, and the bodies that are missing; `None` if it is not.
    fn wait_at(&mut self, step: u64) -> Option<(Instant, &mut Vec<usize>)> {
        if !self.begins_at(step) || self.passed == Some(step) {
            return None;
        }
        if self.wait.as_ref().is_none_or(|(at, ..)| *at != step) {
            self.wait = Some((step, Instant::now(), self.bodies.clone()));
        }
        let (_, since, missing) = self.wait.as_mut()?;
        Some((*since, missing))
    }

    /// Whether the flight waits at this step.
    pub(crate) fn waits(&mut self, scene: &Scene, step: u64) -> bool {
        let (silent, told, deadline) = (self.is_silent(), self.told, self.deadline);
        let Some((since, missing)) = self.wait_at(step) else {
            return false;
        };
        let waited = since.elapsed();
        if !missing.is_empty() && (silent || waited < deadline) {
            if silent && !told && waited >= SILENCE {
                let names = missing.iter().map(|body| scene.bodies[*body].name.as_str());
                let names = names.collect::<Vec<_>>().join(", ");
                warn!("waiting at step {step} for the first wrench on {names}");
                self.told = true;
            }
            return true;
        }
        if let Some(body) = missing.first() {
            let name = &scene.bodies[*body].name;
            warn!(
                "no wrench on {name} with the stamp of step {step} came within {deadline:?}: the flight goes on"
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
        self.unheard.clone_from(&self.bodies);
    }
}
