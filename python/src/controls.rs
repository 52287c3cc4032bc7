//! Controls from Python as the sequences that a flight accepts.

use std::sync::Arc;

use lgvi_dynamics::Load;
use lgvi_msgs::geometry_msgs::Vector3;
use lgvi_msgs::msg::ControlSequence;
use lgvi_propagator::{Axes, Controls, Flight};
use lgvi_scene::Scene;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

use crate::arrays::{body_index, rows, wrenches};
use crate::error;
use crate::plan::Plan;
use crate::state::State;

/// The most intervals of a sequence: flights have no room for many more.
const MOST_INTERVALS: usize = 1 << 23;

/// What controls a flight.
pub(crate) enum Commands {
    /// Sequences that are known beforehand.
    Sequences(Vec<Controls>),
    /// A function that is asked once a period.
    Controller(Controller),
}

impl Commands {
    /// Reads a plan, controls, a sequence of both, a function, or None.
    pub(crate) fn read(
        scene: &Arc<Scene>,
        object: Option<&Bound<'_, PyAny>>,
        period: Option<f64>,
    ) -> PyResult<Self> {
        let Some(object) = object else {
            return Ok(Self::Sequences(Vec::new()));
        };
        if object.is_callable() {
            return Ok(Self::Controller(Controller {
                scene: Arc::clone(scene),
                function: object.clone().unbind(),
                period: steps_of(scene, period)?,
            }));
        }
        if period.is_some() {
            let message = "`period_s` is given, expected it only with a function in `controls`";
            return Err(PyValueError::new_err(message));
        }
        let many = object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>();
        let each: Vec<_> = match many {
            true => object.try_iter()?.collect::<PyResult<_>>()?,
            false => vec![object.clone()],
        };
        let each = each.iter().map(|one| sequence(scene, one));
        each.collect::<PyResult<_>>().map(Self::Sequences)
    }
}

/// The steps of the scene in a period (s).
fn steps_of(scene: &Scene, period: Option<f64>) -> PyResult<u64> {
    let step = scene.seconds(1);
    let Some(period) = period else {
        return Ok(1);
    };
    let steps = (period / step).round();
    let is_whole = (period - steps * step).abs() <= 1e-9 * period;
    if !(is_whole && (1.0..=scene.steps as f64).contains(&steps)) {
        return Err(PyValueError::new_err(format!(
            "`period_s` is {period}, expected a whole number of the scene's steps of {step} s, within its run"
        )));
    }
    Ok(steps as u64)
}

/// Checks a plan or a `lgvi.Controls` against the scene.
pub(crate) fn sequence(scene: &Scene, object: &Bound<'_, PyAny>) -> PyResult<Controls> {
    let py = object.py();
    let message = match object.cast::<Plan>() {
        Ok(plan) => plan.get().message()?,
        Err(_) => message(scene, object)?,
    };
    Controls::of_message(scene, &message).map_err(|error| error::controls(py, error))
}

fn message(scene: &Scene, object: &Bound<'_, PyAny>) -> PyResult<ControlSequence> {
    if !object.hasattr("hold_steps")? {
        let kind = object.get_type();
        return Err(PyTypeError::new_err(format!(
            "controls of {kind}, expected lgvi.Controls, a plan, a list of them, or a function"
        )));
    }
    let get = |name: &str| object.getattr(name);
    let given = |name: &str| PyResult::Ok(Some(get(name)?).filter(|value| !value.is_none()));
    let body = match (given("body")?, scene.bodies.as_slice()) {
        (Some(name), _) => body_index(scene, &name.extract::<String>()?)?,
        (None, [_]) => 0,
        (None, bodies) => {
            let count = bodies.len();
            return Err(PyValueError::new_err(format!(
                "controls without `body` for a scene of {count} bodies, expected the name of one"
            )));
        }
    };
    let named = &scene.bodies[body];
    let frame: String = get("frame")?.extract()?;
    let frame_id = match &*frame {
        "inertial" => scene.frame.clone(),
        "body" => named.frame.clone(),
        _ => {
            let message = format!("`frame` is {frame:?}, expected \"inertial\" or \"body\"");
            return Err(PyValueError::new_err(message));
        }
    };
    let hold: u64 = get("hold_steps")?.extract()?;
    let mut sequence = ControlSequence {
        body: named.name.clone(),
        first_step: get("first_step")?.extract()?,
        step_size: hold as f64 * scene.seconds(1),
        ..ControlSequence::default()
    };
    sequence.header.frame_id = frame_id;
    let intervals = |array: &Bound<'_, PyAny>, name: &str, width| {
        if let Ok(count) = array.len()
            && count > MOST_INTERVALS
        {
            return Err(PyValueError::new_err(format!(
                "`{name}` has {count} intervals, expected at most {MOST_INTERVALS}"
            )));
        }
        rows(array, name, width)
    };
    let vectors = |name: &str| match given(name)? {
        Some(array) => intervals(&array, name, 3).map(Some),
        None => Ok(None),
    };
    let (force, moment) = (vectors("force_n")?, vectors("moment_n_m")?);
    if let Some(torques) = given("wheel_torque_n_m")? {
        if force.is_some() || moment.is_some() {
            let message = "`wheel_torque_n_m` beside a force or a moment, expected two `Controls`";
            return Err(PyValueError::new_err(message));
        }
        sequence.wheel_torque = intervals(&torques, "wheel_torque_n_m", named.wheels.len())?;
        return Ok(sequence);
    }
    let count = force.as_ref().or(moment.as_ref()).map_or(0, Vec::len);
    let [force, moment] = [force, moment].map(|it| it.unwrap_or_else(|| vec![0.0; count]));
    let vectors = |numbers: Vec<f64>| {
        let (each, _) = numbers.as_chunks::<3>();
        let each = each.iter().map(|&[x, y, z]| Vector3 { x, y, z });
        each.collect()
    };
    (sequence.force, sequence.moment) = (vectors(force), vectors(moment));
    Ok(sequence)
}

/// A function `controller(time_s, state)` that returns the wrench of the next period.
pub(crate) struct Controller {
    scene: Arc<Scene>,
    function: Py<PyAny>,
    /// Steps between two calls.
    period: u64,
}

impl Controller {
    /// Asks the function if it is its turn.
    pub(crate) fn command(&self, flight: &mut Flight) -> PyResult<()> {
        if !flight.step().is_multiple_of(self.period) {
            return Ok(());
        }
        Python::attach(|py| {
            let state = State::of(&self.scene, flight);
            let wrench = self.function.bind(py).call1((state.time, state))?;
            let loads = wrenches(&self.scene, &wrench)?;
            for (body, load) in loads.into_iter().enumerate() {
                let Some(load) = load else { continue };
                hold(&self.scene, flight, body, load, self.period)
                    .map_err(|reason| error::controls(py, reason))?;
            }
            Ok(())
        })
    }
}

/// Lets a load act on a body for some steps from the present one on, in place of what acted on it.
fn hold(
    scene: &Scene,
    flight: &mut Flight,
    body: usize,
    load: Load,
    steps: u64,
) -> Result<(), String> {
    check(scene, flight, body, &load)?;
    let controls = Controls {
        body,
        first_step: flight.step(),
        hold: steps,
        axes: Axes::Split,
        loads: vec![load],
        actuation: None,
        law: None,
    };
    flight.accept(controls).map_err(|error| error.to_string())
}

/// Refuses a load that is not finite.
pub(crate) fn check(
    scene: &Scene,
    flight: &Flight,
    body: usize,
    load: &Load,
) -> Result<(), String> {
    if load.is_finite() {
        return Ok(());
    }
    let si = scene.units.load_to_si(load);
    let [force, moment]: [[f64; 3]; 2] = [si.force.into(), si.moment.into()];
    Err(format!(
        "the wrench on {} at step {} is {force:?} N, {moment:?} N m, expected six finite numbers",
        scene.bodies[body].name,
        flight.step()
    ))
}
