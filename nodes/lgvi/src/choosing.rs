//! The choice of an automatic integrator, with a bar on standard error.

use lgvi_dynamics::auto::{Choice, ChoiceError};
use lgvi_middleware::Shutdown;
use lgvi_middleware::node::NodeError;
use lgvi_scene::Scene;

use crate::bars;

/// The scene with what flies it, which is chosen unless it is known; a shutdown ends it.
pub(crate) fn decided(scene: Scene, shutdown: &Shutdown) -> Result<Scene, NodeError> {
    let choice = choose(&scene, Some(shutdown))?;
    lgvi_review::decided(scene, choice.as_ref()).map_err(NodeError::input)
}

/// Chooses what flies the scene, unless that is known; a shutdown ends it.
pub(crate) fn choose(
    scene: &Scene,
    shutdown: Option<&Shutdown>,
) -> Result<Option<Choice>, NodeError> {
    if scene.undecided().is_none() {
        return Ok(None);
    }
    let bar = bars::bar("choosing", 100, "% of the pilot flights");
    let choice = lgvi_review::choose(scene, &mut |part| {
        bar.set_position((100.0 * part) as u64);
        !shutdown.is_some_and(Shutdown::requested)
    });
    bar.finish_and_clear();
    choice.map_err(|error| match error {
        ChoiceError::Interrupted => NodeError::Interrupted,
        error => NodeError::Input(format!("scene {}: {error}", scene.name)),
    })
}
