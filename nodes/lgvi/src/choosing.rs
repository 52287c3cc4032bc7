//! The choice of an automatic integrator, with a bar on standard error.

use std::ops::ControlFlow;

use lgvi_dynamics::auto::{Choice, ChoiceError};
use lgvi_middleware::Shutdown;
use lgvi_middleware::node::NodeError;
use lgvi_scene::{Chosen, Scene};

use crate::bars;

/// The scene with what flies it, which is chosen unless it is known; a shutdown ends it.
pub(crate) fn decided(scene: Scene, shutdown: &Shutdown) -> Result<Scene, NodeError> {
    match choose(&scene, Some(shutdown))? {
        Some(choice) => scene
            .decided(&Chosen::from(&choice).to_string())
            .map_err(NodeError::input),
        None => Ok(scene),
    }
}

/// Chooses what flies the scene, unless that is known; a shutdown ends it.
pub(crate) fn choose(
    scene: &Scene,
    shutdown: Option<&Shutdown>,
) -> Result<Option<Choice>, NodeError> {
    let Some(tolerance) = scene.undecided() else {
        return Ok(None);
    };
    let bar = bars::bar("choosing", 100, "% of the pilot flights");
    let choice = scene.choice(tolerance, &mut |part| {
        bar.set_position((100.0 * part) as u64);
        if shutdown.is_some_and(Shutdown::requested) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    bar.finish_and_clear();
    match choice {
        Ok(choice) => Ok(Some(choice)),
        Err(ChoiceError::Interrupted) => Err(NodeError::Interrupted),
        Err(error) => Err(NodeError::Input(format!("scene {}: {error}", scene.name))),
    }
}
