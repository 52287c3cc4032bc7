//! Steps that fit the shortest time of a maneuver.

use std::time::Duration;

use indicatif::ProgressBar;
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
    let bar = ProgressBar::new_spinner();
    bar.set_style(bars::style("{prefix:>10} {spinner} {msg}"));
    bar.set_prefix("fitting");
    bar.enable_steady_tick(Duration::from_millis(100));
    let plan = lgvi_planner::plan(scene, &mut |now| {
        bar.set_message(format!("iteration {}", now.iteration));
        !shutdown.requested()
    });
    bar.finish_and_clear();
    let plan = plan.map_err(|error| match error.reason {
        Reason::Cancelled => NodeError::Interrupted,
        _ => NodeError::Input(format!("no plan for the maneuver: {error}")),
    })?;
    let Some(duration) = plan.fitting_duration() else {
        return Ok(loaded);
    };
    complain(&format_args!(
        "lgvi: run.duration is {duration}, with which {} steps take the shortest time",
        plan.arrival()
    ));
    let longest = duration * (range.max_steps as f64 / scene.steps as f64);
    let changes = [
        ("run.duration", duration),
        ("maneuver.final_time.max", longest),
    ];
    input.load_with(&changes.map(|(key, value)| (key.into(), format!("{value:?}"))))
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
