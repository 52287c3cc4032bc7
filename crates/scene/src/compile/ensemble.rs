use std::f64::consts::PI;

use lgvi_dynamics::{MassDistribution, Mobility};

use super::disturbance::check_errors;
use crate::file::{EnsembleFile, SpreadFile};
use crate::{Ensemble, Maneuver, Scene, SceneError, Spread};

/// Largest number of samples: files are named by numbers of ten digits.
const MOST_SAMPLES: u64 = 9_999_999_999;

/// Largest standard deviation of the logarithm of mass or inertia. At this limit, the smallest of a million samples is
/// about a ten-thousandth of the nominal value.
const MOST_RELATIVE: f64 = 2.0;

/// Compiles the ensemble of a scene that is complete except for it.
pub(super) fn ensemble(scene: &Scene, file: &EnsembleFile) -> Result<Ensemble, SceneError> {
    if !(1..=MOST_SAMPLES).contains(&file.samples) {
        let expected = format!("1 to {MOST_SAMPLES} samples");
        return Err(SceneError::value(
            "ensemble.samples",
            file.samples,
            expected,
        ));
    }
    let mut planned = scene.maneuver.iter();
    if planned.any(|maneuver| !maneuver.companions.is_empty()) {
        let expected = "none beside `maneuver.companions`: samples fly the plan of one body";
        return Err(SceneError::value(
            "ensemble.samples",
            file.samples,
            expected,
        ));
    }
    for (name, value) in [
        ("force_error", file.force_error),
        ("moment_error", file.moment_error),
        ("actuator_error", file.actuator_error),
    ] {
        let key = format!("ensemble.{name}");
        if deviation(&key, value)? > 0.0 && scene.maneuver.is_none() {
            let expected = "0 without a `maneuver`, whose actuators err";
            return Err(SceneError::value(key, value, expected));
        }
    }
    if let Some(maneuver) = &scene.maneuver {
        let errors = [file.force_error, file.moment_error, file.actuator_error];
        check_errors("ensemble", maneuver, errors)?;
    }
    let mut spreads = vec![Spread::default(); scene.bodies.len()];
    for (index, file) in file.bodies.iter().enumerate() {
        let key = format!("ensemble.bodies[{index}]");
        let body = scene.body_index(&file.body).ok_or_else(|| {
            let names: Vec<_> = scene.bodies.iter().map(|body| body.name.as_str()).collect();
            SceneError::unknown(format!("{key}.body"), &file.body, &names)
        })?;
        if spreads[body] != Spread::default() {
            let expected = "a body that no table before it is about";
            return Err(SceneError::value(
                format!("{key}.body"),
                &file.body,
                expected,
            ));
        }
        spreads[body] = spread(scene, body, &key, file)?;
    }
    Ok(Ensemble {
        samples: file.samples,
        seed: file.seed,
        force_error: file.force_error,
        moment_error: file.moment_error,
        actuator_error: file.actuator_error,
        actuators: scene.maneuver.as_ref().map_or(0, Maneuver::actuators),
        spreads,
    })
}

fn spread(scene: &Scene, body: usize, key: &str, file: &SpreadFile) -> Result<Spread, SceneError> {
    let of = |name: &str, value| deviation(&format!("{key}.{name}"), value);
    let spread = Spread {
        position: of("position", file.position)?,
        velocity: of("velocity", file.velocity)?,
        attitude: of("attitude", file.attitude)?,
        angular_velocity: of("angular_velocity", file.angular_velocity)?,
        mass: of("mass", file.mass)?,
        inertia: of("inertia", file.inertia)?,
    };
    let body = &scene.bodies[body].body;
    let (moves, turns) = match body.mobility() {
        Mobility::Free => (true, true),
        Mobility::Pivoted => (false, true),
        Mobility::Fixed | Mobility::Driven(_) => (false, false),
    };
    let solid = matches!(body.distribution(), MassDistribution::Polyhedron(_));
    for (name, value, possible, why) in [
        (
            "velocity",
            spread.velocity,
            moves,
            "0: the body is not free to move",
        ),
        (
            "angular_velocity",
            spread.angular_velocity,
            turns,
            "0: the body is not free to turn",
        ),
        (
            "mass",
            spread.mass,
            !solid,
            "0: a polyhedron is as heavy as its shape",
        ),
        (
            "attitude",
            spread.attitude,
            spread.attitude <= PI,
            "at most half a turn, π",
        ),
        (
            "mass",
            spread.mass,
            spread.mass <= MOST_RELATIVE,
            "at most 2, relative",
        ),
        (
            "inertia",
            spread.inertia,
            spread.inertia <= MOST_RELATIVE,
            "at most 2, relative",
        ),
    ] {
        if value > 0.0 && !possible {
            return Err(SceneError::value(format!("{key}.{name}"), value, why));
        }
    }
    Ok(spread)
}

fn deviation(key: &str, value: f64) -> Result<f64, SceneError> {
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        let expected = "a standard deviation, a finite number ≥ 0";
        Err(SceneError::value(key, value, expected))
    }
}
