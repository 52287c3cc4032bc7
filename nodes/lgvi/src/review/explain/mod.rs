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

use lgvi_common::Warning;
use lgvi_dynamics::auto::Choice;
use lgvi_scene::Scene;
use serde::Serialize;

use crate::Unusable;
use bodies::Body;
use docking::Docking;
use gravity::Gravity;
use integrator::Integrator;
use maneuver::Maneuver;
use sensors::Sensor;
use skips::Skips;

/// A scene in SI units, its integrator, and warnings.
#[derive(Debug, Serialize)]
pub struct Explanation {
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
    /// What there is to be warned of.
    pub warnings: Vec<Warning>,
}

impl Explanation {
    /// Explains a scene. `choice` is what an automatic integrator has chosen, where the scene does not have it yet.
    ///
    /// # Errors
    /// Returns an error if the scene has no integrator.
    pub fn of(scene: &Scene, choice: Option<&Choice>) -> Result<Self, Unusable> {
        let (integrator, scheme, warnings) = Integrator::of(scene, choice)?;
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
            disturbance: scene
                .disturbance
                .as_ref()
                .map(|disturbance| disturbance.seed),
            integrator,
            skips: Skips::of(scene, scheme),
            warnings,
        })
    }
}

#[cfg(test)]
mod tests;
