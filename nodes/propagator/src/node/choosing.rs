//! The choice of an automatic integrator, unless it was made before.

use std::ops::ControlFlow;

use lgvi_common::{Warning, WarningCode};
use lgvi_dynamics::auto::ChoiceError;
use lgvi_middleware::node::{Node, NodeError};
use lgvi_scene::{Chosen, Scene};
use tracing::info;

/// The scene with what flies it; tells what there is to be warned of.
pub(crate) fn decide(node: &Node, scene: Scene) -> Result<Scene, NodeError> {
    let scene = match scene.undecided() {
        Some(tolerance) => chosen(node, &scene, tolerance)?,
        None => scene,
    };
    let warning = scene
        .chosen
        .as_ref()
        .and_then(|chosen| chosen.warning.clone());
    if let Some(warning) = warning {
        Warning::new(WarningCode::Accuracy, warning).tell(&node.events);
    }
    Ok(scene)
}

fn chosen(node: &Node, scene: &Scene, tolerance: f64) -> Result<Scene, NodeError> {
    info!("choosing an integrator for a tolerance of {tolerance:e}");
    let mut told = 0;
    let choice = scene.choice(tolerance, &mut |part| {
        let tenths = (10.0 * part) as u32;
        if tenths > told {
            told = tenths;
            info!("choosing an integrator: {} %", 10 * tenths);
        }
        if node.shutdown.requested() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    let choice = choice.map_err(|error| match error {
        ChoiceError::Interrupted => NodeError::Interrupted,
        error => NodeError::Input(format!("scene {}: {error}", scene.name)),
    })?;
    scene
        .decided(&Chosen::from(&choice).to_string())
        .map_err(NodeError::input)
}
