//! Axes of another body during a maneuver, predicted by the integration that flies it.

use std::borrow::Cow;
use std::sync::Arc;

use lgvi_control::constraint::FramePose;
use lgvi_dynamics::{BodyState, Load};
use nalgebra::Vector3;

use crate::axes::{Axes, AxesFile, Motion};
use crate::file::RelativeFile;
use crate::{Integration, Scene, SceneError, SceneGravity};

/// The most steps of the integrator that predict the motion of a body.
const MOST_STEPS: u64 = 10_000_000;

/// The predicted axes of a maneuver. Each motion is integrated once.
pub(super) struct Predictions<'s> {
    scene: &'s Scene,
    /// The planned body.
    planned: usize,
    /// The step that the motions are predicted from.
    step: u64,
    /// The states of all bodies then.
    states: Cow<'s, [BodyState]>,
    known: Vec<(&'s RelativeFile, Arc<[Axes]>)>,
}

impl<'s> Predictions<'s> {
    /// Predictions from the start of the scene.
    pub(super) fn new(scene: &'s Scene, planned: usize) -> Self {
        Self {
            scene,
            planned,
            step: 0,
            states: scene.bodies.iter().map(|named| named.state).collect(),
            known: Vec::new(),
        }
    }

    /// Predictions from the states of all bodies at a step of the flight.
    pub(super) fn seen(
        scene: &'s Scene,
        planned: usize,
        step: u64,
        states: &'s [BodyState],
    ) -> Self {
        Self {
            scene,
            planned,
            step,
            states: states.into(),
            known: Vec::new(),
        }
    }

    /// Returns the axes that the table at `key` asks for, at the start of the run and at the end of each step. Before the step
    /// that they are predicted from, they are those of that step.
    pub(super) fn axes(
        &mut self,
        key: &str,
        file: &'s RelativeFile,
    ) -> Result<Arc<[Axes]>, SceneError> {
        if let Some((_, axes)) = self.known.iter().find(|(known, _)| *known == file) {
            return Ok(Arc::clone(axes));
        }
        let axes: Arc<[Axes]> = self.integrated(key, file)?.into();
        self.known.push((file, Arc::clone(&axes)));
        Ok(axes)
    }

    /// Integrates the motion that axes follow.
    ///
    /// The bodies that they belong to are flown as in the run, by the scene's integrator, but without the planned body: it
    /// does not act on them.
    fn integrated(&self, key: &str, file: &RelativeFile) -> Result<Vec<Axes>, SceneError> {
        let &Self {
            scene,
            planned,
            step,
            ..
        } = self;
        let RelativeFile { body, axes, about } = file;
        let key = |name: &str| format!("{key}.{name}");
        let other = |name: &str, body: &str| {
            let names: Vec<_> = scene.bodies.iter().map(|body| body.name.as_str()).collect();
            match scene.body_index(body) {
                Some(index) if index != planned => Ok(index),
                Some(_) => {
                    let expected = "a body other than the planned one";
                    Err(SceneError::value(key(name), body, expected))
                }
                None => Err(SceneError::unknown(key(name), body, &names)),
            }
        };
        let mut flown = vec![other("body", body)?];
        let orbital = matches!(axes, AxesFile::Rtn | AxesFile::Lvlh);
        match (about, &scene.gravity.central) {
            (Some(about), _) if orbital => flown.push(other("about", about)?),
            (Some(about), _) => {
                let expected = format!("none beside {axes} axes, which have no center");
                return Err(SceneError::value(key("about"), about, expected));
            }
            (None, None) if orbital => {
                let expected =
                    "the name of the body in the center, as there is no `gravity.central`";
                return Err(SceneError::missing(key("about"), expected));
            }
            (None, _) => {}
        }
        let alone = Scene {
            bodies: flown
                .iter()
                .map(|index| scene.bodies[*index].clone())
                .collect(),
            gravity: SceneGravity {
                mutual: None,
                ..scene.gravity.clone()
            },
            docking: Vec::new(),
            ..scene.clone()
        };
        let fixed = scene.gravity.central.as_ref();
        let fixed = fixed.map_or_else(Vector3::zeros, |central| central.position);
        let unforeseen = |error: String| {
            let expected = format!("a body whose motion can be predicted: {error}");
            SceneError::value(key("body"), body, expected)
        };
        let Integration::Method(method) = scene.integration else {
            return Err(unforeseen("the integrator is not chosen".into()));
        };
        if scene.steps.saturating_mul(u64::from(scene.substeps)) > MOST_STEPS {
            let expected = format!(
                "at most {MOST_STEPS} substeps in the run, for axes of a body whose motion is predicted"
            );
            return Err(SceneError::value("run.substeps", scene.substeps, expected));
        }
        let states = flown.iter().map(|index| self.states[*index]).collect();
        let scheme = alone.scheme_by(method, scene.substeps);
        let mut simulation = alone
            .simulation_from(states, scheme)
            .map_err(|error| unforeseen(error.to_string()))?;
        let loads = vec![Load::default(); flown.len()];
        let mut all = Vec::with_capacity(scene.steps as usize + 1);
        loop {
            let motions = alone.bodies.iter().zip(simulation.states());
            let motions: Vec<_> = motions
                .map(|(named, state)| Motion::of(&named.body, state))
                .collect();
            let center = motions.get(1).copied().unwrap_or(Motion::at(fixed));
            let now = Axes::of(*axes, &motions[0], &center).ok_or_else(|| {
                let expected = format!("a body that moves around its center, for {axes} axes");
                SceneError::value(key("body"), body, expected)
            })?;
            if all.is_empty() {
                all.resize(step as usize, now);
            }
            all.push(now);
            if step + simulation.step() >= scene.steps {
                return Ok(all);
            }
            simulation
                .advance(&loads)
                .map_err(|error| unforeseen(alone.step_error(&error)))?;
        }
    }
}

impl From<&Axes> for FramePose {
    fn from(axes: &Axes) -> Self {
        Self {
            origin: axes.origin,
            rotation: axes.rotation,
        }
    }
}
