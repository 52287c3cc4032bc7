//! Steps that fit the shortest time of a maneuver.

use lgvi_middleware::Shutdown;
use lgvi_middleware::node::{NodeError, complain};
use lgvi_planner::Reason;
use lgvi_scene::{FinalTime, Minimize, Scene};

use crate::bars;
use crate::scene_input::{Loaded, SceneInput};

/// The scene with the duration of the run at which the same number of steps takes the shortest time of its maneuver, which is
/// planned here to find it.
pub(super) fn fitted(
    input: &SceneInput,
    loaded: Loaded,
    shutdown: &Shutdown,
) -> Result<Loaded, NodeError> {
    let scene = &loaded.scene;
    let range = shortest(scene)?;
    let bar = bars::spinner("fitting");
    bar.enable_steady_tick(bars::TICK);
    let plan = lgvi_planner::plan(scene, &mut |now| {
        bar.set_message(format!("iteration {}", now.iteration));
        !shutdown.requested()
    });
    bar.finish_and_clear();
    let plan = plan.map_err(|error| match error.reason {
        Reason::Cancelled => NodeError::Interrupted,
        Reason::Refused => NodeError::Input(format!("no plan: {error}")),
        _ => NodeError::Runtime(format!("no plan: {error}")),
    })?;
    let Some(duration) = plan.fitting_duration() else {
        complain(&format_args!(
            "lgvi: run.duration stays {}: {}",
            scene.duration,
            plan.remark()
        ));
        return Ok(loaded);
    };
    let longest = duration * (range.max_steps as f64 / scene.steps as f64);
    let changes = [
        ("run.duration", duration),
        ("maneuver.final_time.max", longest),
    ];
    let changes = changes.map(|(key, value)| (key.into(), format!("{value:?}")));
    let fitted = input.load_with("--fit-duration", &changes)?;
    complain(&format_args!(
        "lgvi: run.duration is set to {duration}, from {}: {} steps nearly fit the shortest time",
        scene.duration,
        plan.arrival()
    ));
    Ok(fitted)
}

fn shortest(scene: &Scene) -> Result<FinalTime, NodeError> {
    let range = scene
        .maneuver
        .as_ref()
        .and_then(|maneuver| maneuver.final_time);
    let range = range.filter(|range| range.minimize == Minimize::Time);
    range.ok_or_else(|| {
        NodeError::Input(format!(
            "--fit-duration: scene {} minimizes no time, expected `maneuver.final_time.minimize` = \"time\"",
            scene.name
        ))
    })
}
