use lgvi_control::{Chances, Uncertainty};

use crate::file::ManeuverFile;
use crate::{Commands, Disturbance, Ensemble, Maneuver, Scene, SceneError, Spread};

const KEY: &str = "maneuver.confidence";

/// The probability with which constraints hold, in a scene that is complete except for it.
pub(crate) fn chances(scene: &Scene, file: &ManeuverFile) -> Result<Option<Chances>, SceneError> {
    let (Some(maneuver), Some(confidence)) = (&scene.maneuver, file.confidence) else {
        return Ok(None);
    };
    let refused = |expected: String| Err(SceneError::value(KEY, confidence, expected));
    let others = [
        ("search", maneuver.search.is_some()),
        ("final_time", maneuver.final_time.is_some()),
        ("replan", maneuver.replan.is_some()),
        ("processed", maneuver.processed),
        ("commands", maneuver.commands() != Commands::Loads),
    ];
    if let Some((other, _)) = others.iter().find(|(_, given)| *given) {
        return refused(format!("none beside `{other}`"));
    }
    if maneuver.all_constraints().all(|one| one.is_on_commands()) {
        return refused("none without a constraint on states".into());
    }
    let uncertainty = match (&scene.ensemble, &scene.disturbance) {
        (Some(ensemble), _) => {
            check_ensemble(scene, maneuver, ensemble, file)?;
            of_ensemble(maneuver, ensemble)
        }
        (None, Some(disturbance)) => of_disturbance(disturbance, maneuver.feedback),
        (None, None) => {
            return refused("none without the deviations of `ensemble` or `disturbance`".into());
        }
    };
    match Chances::new(uncertainty, confidence) {
        Ok(chances) => Ok(Some(chances)),
        Err(error) => refused(error.expected),
    }
}

/// Refuses deviations that a plan does not know.
fn check_ensemble(
    scene: &Scene,
    maneuver: &Maneuver,
    ensemble: &Ensemble,
    file: &ManeuverFile,
) -> Result<(), SceneError> {
    let spread = ensemble.spreads[maneuver.body];
    for (what, given) in [("mass", spread.mass), ("inertia", spread.inertia)] {
        if given > 0.0 {
            let expected = "0 of the planned body beside `maneuver.confidence`";
            let key = format!("ensemble.bodies.{what}");
            return Err(SceneError::value(key, given, expected));
        }
    }
    let disperses = |name: &str| {
        let body = scene.body_index(name);
        body.is_some_and(|body| ensemble.spreads[body] != Spread::default())
    };
    let mut relative = file
        .all_constraints()
        .filter_map(|(_, one)| one.relative_to());
    match relative.find(|relative| disperses(&relative.body)) {
        None => Ok(()),
        Some(relative) => {
            let expected = "constraints relative to bodies that `ensemble` does not disperse";
            Err(SceneError::value(KEY, &relative.body, expected))
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
        feedback: maneuver.feedback,
    }
}

fn of_disturbance(disturbance: &Disturbance, feedback: bool) -> Uncertainty {
    Uncertainty {
        position: disturbance.position,
        velocity: disturbance.velocity,
        attitude: disturbance.attitude,
        angular_velocity: disturbance.angular_velocity,
        force_error: disturbance.force_error,
        moment_error: disturbance.moment_error,
        feedback,
    }
}
