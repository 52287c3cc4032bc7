use std::ops::ControlFlow;

use lgvi_dynamics::auto::{Choice, ChoiceError};
use lgvi_scene::{Chosen, Scene, SceneError};

/// Chooses what flies a scene by pilot flights; `None` if that is known. `go_on` is told the completed fraction and ends the
/// search by false.
///
/// # Errors
/// Nothing reaches the tolerance, or the search was ended.
pub fn choose(
    scene: &Scene,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Option<Choice>, ChoiceError> {
    let Some(tolerance) = scene.undecided() else {
        return Ok(None);
    };
    let choice = scene.choice(tolerance, &mut |part| match go_on(part) {
        true => ControlFlow::Continue(()),
        false => ControlFlow::Break(()),
    });
    choice.map(Some)
}

/// The scene with what [`choose`] has chosen for it.
///
/// # Errors
/// The scene has no place for the choice.
pub fn decided(scene: Scene, choice: Option<&Choice>) -> Result<Scene, SceneError> {
    match choice {
        Some(choice) => scene.decided(&Chosen::from(choice).to_string()),
        None => Ok(scene),
    }
}
