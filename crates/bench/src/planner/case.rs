//! A scene's maneuver in any number of steps, and where commands lead when the propagator flies them.

use std::path::Path;

use lgvi_control::{Transfer, miss};
use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::{CentralAttractor, Maneuver, NamedBody, Scene};

use crate::error::BenchError;
use crate::run::SCENES;

/// A maneuver.
pub(crate) struct Case {
    pub(crate) scene: Scene,
}

impl Case {
    /// Of the scene of this name.
    pub(crate) fn load(name: &str) -> Result<Self, BenchError> {
        let path = Path::new(SCENES).join(name).with_extension("toml");
        let text =
            std::fs::read_to_string(&path).map_err(|source| BenchError::Read { path, source })?;
        let scene = Scene::parse(name, &text).map_err(|source| BenchError::Scene {
            name: name.into(),
            source,
        })?;
        Ok(Self { scene })
    }

    pub(crate) fn name(&self) -> &str {
        &self.scene.name
    }

    /// The same in another number of steps.
    pub(crate) fn with_steps(&self, steps: usize) -> Self {
        let mut scene = self.scene.clone();
        scene.steps = steps as u64;
        Self { scene }
    }

    /// The same from another state, its last `steps` steps at an unchanged step `h`.
    pub(crate) fn remaining(&self, steps: usize, from: BodyState) -> Result<Self, BenchError> {
        let mut scene = self.scene.clone();
        scene.duration = scene.h() * steps as f64;
        scene.steps = steps as u64;
        let body = self.maneuver()?.body;
        scene.bodies[body].state = from;
        Ok(Self { scene })
    }

    pub(crate) fn maneuver(&self) -> Result<&Maneuver, BenchError> {
        self.scene
            .maneuver
            .as_ref()
            .ok_or_else(|| self.without("a maneuver"))
    }

    /// The attractor, which the peers take to be at the origin.
    pub(crate) fn attractor(&self) -> Result<&CentralAttractor, BenchError> {
        self.scene
            .gravity
            .central
            .as_ref()
            .filter(|central| central.position.norm() == 0.0 && central.oblateness.is_none())
            .ok_or_else(|| self.without("a spherical attractor at the origin"))
    }

    /// The body with its initial state.
    pub(crate) fn body(&self) -> Result<&NamedBody, BenchError> {
        Ok(&self.scene.bodies[self.maneuver()?.body])
    }

    /// The state to be reached.
    pub(crate) fn target(&self) -> Result<BodyState, BenchError> {
        let target = self.maneuver()?.target.state();
        target.ok_or_else(|| self.without("a target that is one state"))
    }

    pub(crate) fn transfer(&self) -> Result<Transfer, BenchError> {
        let transfer = self.scene.transfer();
        let transfer = transfer.ok_or_else(|| self.without("a maneuver"))?;
        transfer.map_err(|error| BenchError::Body(format!("{}: {error}", self.name())))
    }

    /// By how much the propagator's flight with these controls misses the target.
    pub(crate) fn violation(&self, controls: &[Load]) -> Result<f64, BenchError> {
        let refuse = |error: &dyn std::fmt::Display| {
            BenchError::Body(format!("{} cannot be flown: {error}", self.name()))
        };
        let scheme = self.scene.scheme().map_err(|error| refuse(&error))?;
        let mut simulation = self
            .scene
            .simulation(scheme)
            .map_err(|error| refuse(&error))?;
        let maneuver = self.maneuver()?;
        let mut loads = vec![Load::default(); simulation.states().len()];
        for control in controls {
            loads[maneuver.body] = *control;
            simulation.advance(&loads)?;
        }
        let target = self.target()?;
        Ok(miss(&target, &simulation.states()[maneuver.body]).norm())
    }

    fn without(&self, what: &str) -> BenchError {
        BenchError::Body(format!("scene {} has no {what}", self.name()))
    }
}
