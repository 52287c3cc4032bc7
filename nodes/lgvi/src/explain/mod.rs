//! What a scene is and how it will be flown, without flying it.

mod bodies;
mod choice;
mod docking;
mod gravity;
mod integrator;
mod maneuver;
mod sensors;
mod skips;
mod text;
mod trial;

use std::process::ExitCode;

use clap::Args;
use lgvi_common::Warning;
use lgvi_middleware::node::NodeError;
use lgvi_scene::Scene;
use serde::Serialize;

use crate::output::say;
use crate::scene_input::SceneInput;
use crate::strictness::Strictness;
use bodies::Body;
use docking::Docking;
use gravity::Gravity;
use integrator::Integrator;
use maneuver::Maneuver;
use sensors::Sensor;
use skips::Skips;

/// The command line of `lgvi explain`.
#[derive(Args)]
pub(crate) struct Options {
    #[command(flatten)]
    input: SceneInput,
    /// Print the explanation as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    strictness: Strictness,
}

/// A scene in SI units, its integrator, and warnings.
#[derive(Debug, Serialize)]
struct Explanation {
    scene: String,
    title: String,
    /// (s)
    duration: f64,
    steps: u64,
    /// (s)
    step_size: f64,
    bodies: Vec<Body>,
    gravity: Gravity,
    docking: Vec<Docking>,
    sensors: Vec<Sensor>,
    maneuver: Option<Maneuver>,
    /// Seed of the maneuver's disturbance.
    disturbance: Option<u64>,
    integrator: Integrator,
    skips: Skips,
    warnings: Vec<Warning>,
}

/// Explains the scene in a file.
pub(crate) fn explain(options: &Options) -> Result<ExitCode, NodeError> {
    let explanation = Explanation::of(&options.input.load()?.scene)?;
    if options.json {
        say(&serde_json::to_string(&explanation).map_err(NodeError::runtime)?)?;
    } else {
        say(&explanation)?;
    }
    Ok(options.strictness.exit_code(&explanation.warnings))
}

impl Explanation {
    fn of(scene: &Scene) -> Result<Self, NodeError> {
        let (integrator, scheme, warnings) = Integrator::of(scene)?;
        Ok(Self {
            scene: scene.name.clone(),
            title: scene.title.clone(),
            duration: scene.duration * scene.units.time,
            steps: scene.steps,
            step_size: scene.h() * scene.units.time,
            bodies: scene
                .bodies
                .iter()
                .map(|named| Body::of(named, &scene.units))
                .collect(),
            gravity: Gravity::of(scene),
            docking: Docking::of(scene),
            sensors: Sensor::of(scene),
            maneuver: Maneuver::of(scene),
            disturbance: scene.disturbance.map(|disturbance| disturbance.seed),
            integrator,
            skips: Skips::of(scene, scheme),
            warnings,
        })
    }
}

#[cfg(test)]
mod tests;
