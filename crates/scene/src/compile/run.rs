use std::ops::RangeInclusive;

use lgvi_dynamics::{MethodError, System};

use super::maneuver;
use crate::file::{ManeuverFile, RunFile};
use crate::integrator::SkipFile;
use crate::{Integration, Scene, SceneError, Skipping};

/// J2000, 2000-01-01T12:00:00Z (ns since the UNIX epoch).
pub(super) const J2000: i64 = 946_728_000_000_000_000;

/// The last second that a ROS time can represent.
const MAX_ROS_SECOND: i64 = i32::MAX as i64;

/// Range of accuracies that an automatic integrator accepts.
const TOLERANCES: RangeInclusive<f64> = 1e-14..=0.1;

/// Greatest depth of subdivision, which cuts a step into about a million parts.
const MAX_SUBDIVIDE: u32 = 20;

/// Returns the epoch (ns since the UNIX epoch).
pub(super) fn epoch(run: &RunFile) -> Result<i64, SceneError> {
    let Some(datetime) = run.epoch else {
        return Ok(J2000);
    };
    let text = datetime.to_string();
    let expected = "a date and time with offset, such as 2000-01-01T12:00:00Z, from 1970 to 2038, not the very start of 1970";
    let refuse = || SceneError::value("run.epoch", &text, expected);
    let parsed = chrono::DateTime::parse_from_rfc3339(&text).map_err(|_| refuse())?;
    let nanoseconds = parsed.timestamp_nanos_opt().ok_or_else(refuse)?;
    // A stamp of 0 means that the stamp was not set.
    if nanoseconds > 0 && parsed.timestamp() < MAX_ROS_SECOND {
        Ok(nanoseconds)
    } else {
        Err(refuse())
    }
}

/// Returns the scene's integrator. For a maneuver, `auto` becomes the method of the planned steps.
pub(super) fn integration(
    run: &RunFile,
    planned: Option<&ManeuverFile>,
) -> Result<Integration, SceneError> {
    match run.integrator.integration() {
        Integration::Auto { tolerance } if !TOLERANCES.contains(&tolerance) => {
            let key = "run.integrator.tolerance";
            Err(SceneError::value(key, tolerance, "1e-14 to 0.1"))
        }
        integration @ Integration::Auto { .. } => Ok(planned.map_or(integration, |planned| {
            Integration::Method(maneuver::method(planned))
        })),
        integration => Ok(integration),
    }
}

/// Returns the accuracy asked of an automatic integrator if a maneuver determines the method instead.
pub(super) fn accuracy(run: &RunFile, planned: Option<&ManeuverFile>) -> Option<f64> {
    match run.integrator.integration() {
        Integration::Auto { tolerance } => planned.map(|_| tolerance),
        Integration::Method(_) => None,
    }
}

/// Part of an automatic integrator's tolerance that skipped computations may use up.
const SKIPPED: f64 = 0.1;

/// Returns what the computation may skip. The default with an automatic integrator is a part of its tolerance.
pub(super) fn skipping(run: &RunFile, integration: Integration) -> Result<Skipping, SceneError> {
    match (run.skip, integration) {
        (Some(SkipFile::Nothing), _) => Ok(Skipping::Nothing),
        (Some(SkipFile::Tolerance(tolerance)), _) if TOLERANCES.contains(&tolerance) => {
            Ok(Skipping::Within(tolerance))
        }
        (Some(SkipFile::Tolerance(tolerance)), _) => Err(SceneError::value(
            "run.skip.tolerance",
            tolerance,
            "1e-14 to 0.1",
        )),
        (None, Integration::Auto { tolerance }) => Ok(Skipping::Within(SKIPPED * tolerance)),
        (Some(SkipFile::Exact) | None, _) => Ok(Skipping::Exact),
    }
}

pub(super) fn substeps(run: &RunFile) -> Result<u32, SceneError> {
    let chosen = matches!(run.integrator.integration(), Integration::Auto { .. });
    if let (true, Some(substeps)) = (chosen, run.substeps) {
        let expected = "none: the integrator `auto` chooses the number of substeps";
        return Err(SceneError::value("run.substeps", substeps, expected));
    }
    match run.substeps {
        None => Ok(1),
        Some(0) => Err(SceneError::value("run.substeps", 0, "a whole number > 0")),
        Some(substeps) => Ok(substeps),
    }
}

pub(super) fn subdivide(run: &RunFile) -> Result<u32, SceneError> {
    if run.subdivide > 0
        && let Integration::Method(method) = run.integrator.integration()
        && method.has_error_control()
    {
        let expected = format!("0 beside {method}, which cuts its steps itself");
        return Err(SceneError::value("run.subdivide", run.subdivide, expected));
    }
    if run.subdivide <= MAX_SUBDIVIDE {
        Ok(run.subdivide)
    } else {
        let expected = format!("0 to {MAX_SUBDIVIDE}, how often a step may be halved");
        Err(SceneError::value("run.subdivide", run.subdivide, expected))
    }
}

/// Checks that the lengths of steps and substeps are normal numbers.
pub(super) fn check_step(scene: &Scene) -> Result<(), SceneError> {
    let substep = scene.h() / f64::from(scene.substeps);
    if scene.h().is_normal() && substep.is_normal() {
        return Ok(());
    }
    let expected = match scene.substeps {
        1 => format!("a duration that {} steps can divide", scene.steps),
        n => format!("a duration that {} steps of {n} can divide", scene.steps),
    };
    Err(SceneError::value("run.duration", scene.duration, expected))
}

/// Checks that the end is in the range of ROS times.
pub(super) fn check_end(scene: &Scene) -> Result<(), SceneError> {
    let end = scene.epoch as f64 * 1e-9 + scene.seconds(scene.steps);
    if end <= MAX_ROS_SECOND as f64 {
        return Ok(());
    }
    let expected = "an end that a ROS time can say, before 2038-01-19T03:14:07Z";
    Err(SceneError::value("run.duration", scene.duration, expected))
}

/// Checks that the scene's method can integrate it.
pub(super) fn check_method(scene: &Scene, system: &System) -> Result<(), SceneError> {
    match scene.integration {
        Integration::Method(method) => match method.integrator(system) {
            Ok(_) => Ok(()),
            Err(error) => Err(refused(scene, error)),
        },
        Integration::Auto { .. } => Ok(()),
    }
}

/// Returns the reason that a method cannot fly the scene, with the key that is at fault.
fn refused(scene: &Scene, error: MethodError) -> SceneError {
    match error {
        MethodError::Parameter {
            method,
            parameter,
            value,
            expected,
        } => {
            let (key, value) = match parameter {
                "order of the rotor" => ("rotor", format!("of order {value}")),
                "number of quadrature points" => ("points", value.to_string()),
                other => (other, value.to_string()),
            };
            SceneError::Value {
                line: None,
                key: format!("run.integrator.{key}"),
                value,
                expected: format!("{expected}, for {method}"),
            }
        }
        MethodError::Body {
            method,
            body,
            expected,
        } => {
            let name = &scene.bodies[body].name;
            let expected = format!("{expected}: {method} cannot integrate {name}");
            SceneError::value("run.integrator", scene.integration.to_string(), expected)
        }
        error => {
            let expected = format!("an integrator for the scene: {error}");
            SceneError::value("run.integrator", scene.integration.to_string(), expected)
        }
    }
}
