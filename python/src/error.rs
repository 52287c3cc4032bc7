//! Errors of the libraries as the exceptions of `lgvi.errors`.

use std::fmt::Display;
use std::path::Path;

use lgvi_common::{KeyError, SceneFileError, SceneFileReason};
use lgvi_dynamics::StepError;
use lgvi_planner::{NoPlan, Reason};
use lgvi_scene::{Scene, SceneError};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;

use crate::scene::Refused;

/// Returns an exception of `lgvi.errors`, made with these arguments.
fn exception<'py>(
    py: Python<'py>,
    class: &'static PyOnceLock<Py<PyType>>,
    name: &str,
    arguments: impl pyo3::call::PyCallArgs<'py>,
) -> PyErr {
    let made = class
        .import(py, "lgvi.errors", name)
        .and_then(|class| class.call1(arguments));
    match made {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}

macro_rules! exception {
    ($py:expr, $name:literal, $arguments:expr) => {{
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        exception($py, &CLASS, $name, $arguments)
    }};
}

pub(crate) fn scene(py: Python<'_>, file: Option<&Path>, error: &SceneError) -> PyErr {
    scene_with(py, file, "", error)
}

/// `context` is what the scene differs by from its file.
fn scene_with(py: Python<'_>, file: Option<&Path>, context: &str, error: &SceneError) -> PyErr {
    let file = file.map(|file| file.display().to_string());
    let message = match &file {
        Some(file) => format!("scene {file}: {context}{error}"),
        None => format!("scene: {context}{error}"),
    };
    match error {
        SceneError::Value {
            line,
            key,
            value,
            expected,
        } => exception!(
            py,
            "SceneError",
            (message, file, *line, key, value, expected)
        ),
        _ => {
            let line = line(&message);
            exception!(py, "SceneError", (message, file, line))
        }
    }
}

/// The line that a message of TOML's parser names.
fn line(message: &str) -> Option<usize> {
    let (_, rest) = message.split_once("TOML parse error at line ")?;
    let digits = rest.split(|character: char| !character.is_ascii_digit());
    digits.into_iter().next()?.parse().ok()
}

pub(crate) fn scene_file(py: Python<'_>, error: &SceneFileError) -> PyErr {
    match &error.reason {
        SceneFileReason::Scene(reason) => scene(py, Some(&error.path), reason),
        SceneFileReason::Unreadable(_) => {
            let file = error.path.display().to_string();
            exception!(py, "SceneError", (error.to_string(), file))
        }
    }
}

/// A scene that has no integrator, or a value of it that is wrong.
pub(crate) fn unfit(py: Python<'_>, error: impl Display) -> PyErr {
    exception!(py, "SceneError", (error.to_string(),))
}

/// Values that a scene refuses.
pub(crate) fn refused(
    py: Python<'_>,
    file: Option<&Path>,
    context: &str,
    refused: &Refused,
) -> PyErr {
    match refused {
        Refused::Key(error) => {
            let KeyError { key, value, reason } = error;
            of_key(py, (error.to_string(), key, Some(value), reason))
        }
        Refused::Scene(error) => scene_with(py, file, context, error),
    }
}

/// A key that varies over no values.
pub(crate) fn no_values(py: Python<'_>, key: &str, error: impl Display) -> PyErr {
    of_key(py, (error.to_string(), key, None, "at least one value"))
}

fn of_key(
    py: Python<'_>,
    (message, key, value, expected): (String, &str, Option<&String>, &str),
) -> PyErr {
    let none = py.None();
    let file = none.clone_ref(py);
    exception!(
        py,
        "SceneError",
        (message, file, none, key, value, expected)
    )
}

pub(crate) fn step(py: Python<'_>, scene: &Scene, step: u64, error: &StepError) -> PyErr {
    let time = scene.seconds(step);
    let message = format!(
        "step {step}, at {time} s: {reason}",
        reason = scene.step_error(error)
    );
    exception!(py, "FlightError", (message, step, time))
}

/// A matrix or quaternion with a defect; `place` is where it is.
pub(crate) fn rotation(py: Python<'_>, place: &str, defect: &str) -> PyErr {
    exception!(py, "RotationError", (format!("{place}: {defect}"),))
}

pub(crate) fn controls(py: Python<'_>, error: impl Display) -> PyErr {
    exception!(py, "ControlError", (error.to_string(),))
}

pub(crate) fn plan(py: Python<'_>, error: &NoPlan) -> PyErr {
    let reason = match error.reason {
        Reason::Infeasible => "infeasible",
        Reason::NotConverged | Reason::Deadline | Reason::Cancelled => "not_converged",
        Reason::Refused => "refused",
    };
    exception!(py, "PlanError", (error.to_string(), reason))
}

pub(crate) fn ensemble(py: Python<'_>, error: impl Display) -> PyErr {
    exception!(py, "EnsembleError", (error.to_string(),))
}

/// Refuses a number of threads.
pub(crate) fn threads(threads: usize) -> PyResult<()> {
    let checked = lgvi_review::check_threads(threads);
    checked.map_err(|error| PyValueError::new_err(format!("`threads`: {error}")))
}

/// Refuses a path where there is nothing to read, with the exception that Python has for it.
pub(crate) fn readable(path: &Path, what: &str) -> PyResult<()> {
    std::fs::metadata(path).map(drop).map_err(|error| {
        let message = format!("{what} cannot be read");
        PyOSError::new_err((error.raw_os_error(), message, path.display().to_string()))
    })
}

pub(crate) fn bag(py: Python<'_>, error: impl Display) -> PyErr {
    exception!(py, "BagError", (error.to_string(),))
}
