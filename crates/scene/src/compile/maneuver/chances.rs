use lgvi_control::{Chances, Uncertainty};

use crate::file::ManeuverFile;
use crate::{Disturbance, Ensemble, Maneuver, Minimize, Scene, SceneError, Spread, StateDeviation};

const KEY: &str = "maneuver.confidence";

/// The probability with which constraints hold, in a scene that is complete except for it.
pub(crate) fn chances(scene: &Scene, file: &ManeuverFile) -> Result<Option<Chances>, SceneError> {
    let (Some(maneuver), Some(confidence)) = (&scene.maneuver, file.confidence) else {
        return Ok(None);
    };
    let refused = |expected: String| Err(SceneError::value(KEY, confidence, expected));
    let minimized = maneuver.final_time.map(|range| range.minimize);
    let others = [
        (
            "a `final_time` that minimizes the time",
            minimized == Some(Minimize::Time),
        ),
        ("`replan`", maneuver.replan.is_some()),
        ("`processed`", maneuver.processed),
    ];
    if let Some((other, _)) = others.iter().find(|(_, given)| *given) {
        return refused(format!("none beside {other}"));
    }
    if maneuver.uses_propellant(scene) {
        return refused("none where thrusters use propellant".into());
    }
    if maneuver.all_constraints().all(|one| one.is_on_commands()) {
        return refused("none without a constraint on states".into());
    }
    let uncertainty = match (&scene.ensemble, &scene.disturbance) {
        (Some(ensemble), _) => {
            check_relative(scene, file, "ensemble", |body| {
                ensemble.spreads[body] != Spread::default()
            })?;
            of_ensemble(maneuver, ensemble)
        }
        (None, Some(disturbance)) => {
            let others = &disturbance.others;
            let deviates = |body| {
                let mut others = others.iter();
                others.any(|(other, by)| *other == body && *by != StateDeviation::default())
            };
            check_relative(scene, file, "disturbance", deviates)?;
            of_disturbance(disturbance, maneuver.feedback)
        }
        (None, None) => {
            return refused("none without the deviations of `ensemble` or `disturbance`".into());
        }
    };
    match Chances::new(uncertainty, confidence) {
        Ok(chances) => Ok(Some(chances)),
        Err(error) => refused(error.expected),
    }
}

/// Refuses constraints relative to bodies that deviate.
fn check_relative(
    scene: &Scene,
    file: &ManeuverFile,
    table: &str,
    deviates: impl Fn(usize) -> bool,
) -> Result<(), SceneError> {
    let relative = file
        .all_constraints()
        .filter_map(|(_, one)| one.relative_to());
    let mut names = relative.flat_map(|relative| relative.about.iter().chain([&relative.body]));
    match names.find(|name| scene.body_index(name).is_some_and(&deviates)) {
        None => Ok(()),
        Some(name) => {
            let expected = format!("constraints relative to bodies that `{table}` leaves alone");
            Err(SceneError::value(KEY, name, expected))
        }
    }
}

fn of_ensemble(maneuver: &Maneuver, ensemble: &Ensemble) -> Uncertainty {
    let spread = ensemble.spreads[maneuver.body];
    Uncertainty {
        position: spread.position,
        velocity: spread.velocity,
        attitude: spread.attitude,
        angular_velocity: spread.angular_velocity,
        force_error: ensemble.force_error,
        moment_error: ensemble.moment_error,
        actuator_error: ensemble.actuator_error,
        mass: spread.mass,
        inertia: spread.inertia,
        feedback: maneuver.feedback,
    }
}

fn of_disturbance(disturbance: &Disturbance, feedback: bool) -> Uncertainty {
    let state = disturbance.state;
    Uncertainty {
        position: state.position,
        velocity: state.velocity,
        attitude: state.attitude,
        angular_velocity: state.angular_velocity,
        force_error: disturbance.force_error,
        moment_error: disturbance.moment_error,
        actuator_error: disturbance.actuator_error,
        mass: 0.0,
        inertia: 0.0,
        feedback,
    }
}
