//! Flies a scene and keeps samples.

use std::sync::Arc;

use lgvi_dynamics::{BodyState, Load, StepError};
use lgvi_propagator::Flight;
use lgvi_scene::{Scene, Scheme};
use pyo3::exceptions::{PyMemoryError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::room;
use crate::controls::{Commands, Controller};
use crate::error;
use crate::force::{Raised, simulation};
use crate::trajectory::Samples;
use crate::watch::Watch;

/// Steps between two looks at the clock.
const LOOK: u64 = 32;

/// By how much a time may miss that of the step with this number and still be that of the step, in steps.
fn near(step: f64) -> f64 {
    1e-9 + 4.0 * f64::EPSILON * step
}

/// The most states that are kept unless times are asked for: some 3 GB.
const MOST_STATES: u64 = 1 << 24;

/// A time at which a sample is kept.
#[derive(Clone, Copy)]
pub(crate) struct Output {
    /// (s)
    time: f64,
    /// The last step up to it.
    step: u64,
    /// The part of the next step that is flown to it.
    part: f64,
}

/// Returns the times at which samples are kept: those of `t_eval` (s), or those at which the scene's states are published.
pub(crate) fn outputs(scene: &Scene, t_eval: Option<Vec<f64>>) -> PyResult<Vec<Output>> {
    let on_step = |step| Output {
        time: scene.seconds(step),
        step,
        part: 0.0,
    };
    let Some(times) = t_eval else {
        let every = scene.publishing.state_every.max(1);
        let bodies = scene.bodies.len() as u64;
        let states = (scene.steps / every).saturating_mul(bodies);
        if states > MOST_STATES {
            return Err(PyValueError::new_err(format!(
                "{states} states would be kept, expected {MOST_STATES} at most without `t_eval`"
            )));
        }
        let last = !scene.steps.is_multiple_of(every);
        let steps = (0..=scene.steps).step_by(usize::try_from(every).unwrap_or(usize::MAX));
        let count = usize::try_from(scene.steps / every).unwrap_or(usize::MAX);
        let mut outputs = room(count.saturating_add(2))?;
        outputs.extend(steps.chain(last.then_some(scene.steps)).map(on_step));
        return Ok(outputs);
    };
    let end = scene.seconds(scene.steps);
    let step = scene.seconds(1);
    let mut outputs: Vec<Output> = room(times.len())?;
    for (index, time) in times.into_iter().enumerate() {
        let steps = time / step;
        let latest = outputs.last().map_or(0.0, |output| output.time);
        let last = scene.steps as f64;
        let within = time >= latest && steps <= last + near(last);
        if !within {
            return Err(PyValueError::new_err(format!(
                "`t_eval[{index}]` is {time} s, expected increasing times from 0 to {end} s"
            )));
        }
        let nearest = steps.round();
        let output = if (steps - nearest).abs() <= near(steps) {
            on_step(nearest as u64)
        } else {
            Output {
                time,
                step: steps.floor() as u64,
                part: steps - steps.floor(),
            }
        };
        outputs.push(output);
    }
    let between = outputs.iter().find(|output| output.part > 0.0);
    let actuators = scene.has_actuators();
    if let Some(Output { time, .. }) = between
        && (actuators || !scene.docking.is_empty())
    {
        return Err(PyValueError::new_err(format!(
            "`t_eval` has {time} s, expected whole numbers of steps of {step} s where bodies dock or have actuators"
        )));
    }
    Ok(outputs)
}

/// Why a flight ends early.
enum End {
    Step(u64, StepError),
    Python(PyErr),
    /// It was interrupted.
    Watched,
    Memory,
}

/// A scene with what flies it.
pub(crate) struct Flown {
    pub(crate) scene: Arc<Scene>,
    pub(crate) scheme: Scheme,
    /// A force of Python.
    pub(crate) force: Option<Py<PyAny>>,
}

impl Flown {
    /// Returns the flight at step 0, and where exceptions of its force go.
    pub(crate) fn begin(&self, py: Python<'_>) -> PyResult<(Flight, Raised)> {
        let raised = Raised::default();
        let states = self.scene.initial_states();
        let force = self.force.as_ref().map(|force| (force, &raised));
        let simulation = simulation(py, &self.scene, states, self.scheme, force)?;
        let flight = Flight::of(&self.scene, self.scheme, simulation);
        Ok((flight, raised))
    }

    /// Flies and keeps the outputs.
    pub(crate) fn fly(
        &self,
        py: Python<'_>,
        outputs: &[Output],
        commands: Commands,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Samples> {
        let (mut flight, raised) = self.begin(py)?;
        let mut watch = Watch::new(progress);
        let controller = match commands {
            Commands::Controller(controller) => Some(controller),
            Commands::Sequences(sequences) => {
                for controls in sequences {
                    let admitted = flight.admit(controls);
                    admitted.map_err(|error| error::controls(py, error))?;
                }
                None
            }
        };
        let mut run = Run {
            flown: self,
            part: None,
            raised: &raised,
            samples: Samples::default(),
        };
        let ended = py.detach(|| run.fly(&mut flight, outputs, controller.as_ref(), &mut watch));
        if let Some(error) = raised.take() {
            return Err(error);
        }
        match ended {
            Ok(()) => {
                watch.end(py)?;
                run.samples.docked = flight.docked().to_vec();
                Ok(run.samples)
            }
            Err(End::Step(step, error)) => Err(error::step(py, &self.scene, step, &error)),
            Err(End::Python(error)) => Err(error),
            Err(End::Watched) => Err(watch
                .interrupted()
                .unwrap_or_else(|| pyo3::exceptions::PyKeyboardInterrupt::new_err(()))),
            Err(End::Memory) => {
                let count = outputs.len();
                let message = format!("{count} samples do not fit, expected fewer in `t_eval`");
                Err(PyMemoryError::new_err(message))
            }
        }
    }
}

struct Run<'f> {
    flown: &'f Flown,
    /// The scene with a single step, a part of one of its own.
    part: Option<Arc<Scene>>,
    raised: &'f Raised,
    samples: Samples,
}

impl Run<'_> {
    fn fly(
        &mut self,
        flight: &mut Flight,
        outputs: &[Output],
        controller: Option<&Controller>,
        watch: &mut Watch,
    ) -> Result<(), End> {
        let bodies = flight.states().len();
        let (times, states) = (outputs.len(), outputs.len().saturating_mul(bodies));
        let Samples {
            times: kept,
            states: kept_states,
            loads,
            actuators,
            ..
        } = &mut self.samples;
        (kept.try_reserve_exact(times)).map_err(|_| End::Memory)?;
        (kept_states.try_reserve_exact(states)).map_err(|_| End::Memory)?;
        (loads.try_reserve_exact(states)).map_err(|_| End::Memory)?;
        (actuators.reserve(flight.system(), times)).map_err(|_| End::Memory)?;
        let mut advance =
            |flight: &mut Flight, to| advance(flight, to, &self.flown.scene, controller, watch);
        let mut outputs = outputs.iter().copied().peekable();
        while let Some(output) = outputs.next() {
            advance(flight, output.step)?;
            if output.part == 0.0 {
                self.keep(output.time, flight.states(), flight.loads());
                self.samples.actuators.keep(flight.system());
                continue;
            }
            // What acts in a step is known when it has been made.
            let before = flight.states().to_vec();
            advance(flight, output.step + 1)?;
            let mut output = Some(output);
            while let Some(now) = output {
                let states = self.fly_part(before.clone(), flight.loads(), now)?;
                self.keep(now.time, &states, flight.loads());
                output = outputs.next_if(|next| next.step == now.step && next.part > 0.0);
            }
        }
        Ok(())
    }

    fn keep(&mut self, time: f64, states: &[BodyState], loads: &[Load]) {
        self.samples.times.push(time);
        self.samples.states.extend_from_slice(states);
        self.samples.loads.extend_from_slice(loads);
    }

    /// Makes a part of a step from the states at its start.
    fn fly_part(
        &mut self,
        states: Vec<BodyState>,
        loads: &[Load],
        output: Output,
    ) -> Result<Vec<BodyState>, End> {
        let whole = &self.flown.scene;
        let part = self.part.get_or_insert_with(|| {
            let mut part = Scene::clone(whole);
            part.steps = 1;
            Arc::new(part)
        });
        Arc::make_mut(part).duration = output.part * whole.h();
        let (part, scheme) = (Arc::clone(part), self.flown.scheme);
        let made = Python::attach(|py| {
            let force = self.flown.force.as_ref().map(|force| (force, self.raised));
            simulation(py, &part, states, scheme, force)
        });
        let mut simulation = made.map_err(End::Python)?;
        let made = simulation.advance(loads);
        made.map_err(|error| End::Step(output.step, error))?;
        Ok(simulation.states().to_vec())
    }
}

/// Makes all steps up to this one.
fn advance(
    flight: &mut Flight,
    to: u64,
    scene: &Scene,
    controller: Option<&Controller>,
    watch: &mut Watch,
) -> Result<(), End> {
    while flight.step() < to {
        let step = flight.step();
        let until = match controller {
            None => to.min(step - step % LOOK + LOOK),
            Some(controller) => {
                controller.command(flight).map_err(End::Python)?;
                step + 1
            }
        };
        while flight.step() < until {
            let step = flight.step();
            let made = flight.advance();
            made.map_err(|error| End::Step(step, error))?;
        }
        if !watch.go_on(until as f64 / scene.steps as f64) {
            return Err(End::Watched);
        }
    }
    Ok(())
}
