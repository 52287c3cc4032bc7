//! Axes of another body during a maneuver, predicted by the integration that flies it.

use std::borrow::Cow;
use std::sync::Arc;

use lgvi_control::constraint::{FrameMotion, FramePose};
use lgvi_dynamics::{BodyState, Load, RigidBody};
use nalgebra::Vector3;

use crate::axes::{Axes, AxesFile, Motion};
use crate::file::RelativeFile;
use crate::{Integration, Scene, SceneError, SceneGravity, Scheme};

/// The most steps of the integrator that predict the motion of a body.
const MOST_STEPS: u64 = 10_000_000;

/// The states of all bodies at a step of a flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// Steps made.
    pub step: u64,
    /// The states, in the scene's units.
    pub states: Vec<BodyState>,
}

/// The predicted axes of a maneuver. Each motion is integrated once.
pub(super) struct Predictions<'s> {
    scene: &'s Scene,
    /// The planned body.
    planned: usize,
    states: Known<'s>,
    known: Vec<(&'s RelativeFile, Arc<[Axes]>)>,
}

/// What is known of the bodies' states.
enum Known<'s> {
    /// The states at some steps, in the order of these.
    Seen(Cow<'s, [Seen]>),
    /// The states at the end of the run, of bodies that may replace those of the scene.
    End(&'s [RigidBody], &'s [BodyState]),
}

impl<'s> Predictions<'s> {
    /// Predictions from the start of the scene.
    pub(super) fn new(scene: &'s Scene, planned: usize) -> Self {
        let states = scene.bodies.iter().map(|named| named.state).collect();
        let start = vec![Seen { step: 0, states }];
        Self::of(scene, planned, Known::Seen(start.into()))
    }

    /// Predictions from what has been seen of a flight, in the order of the steps.
    pub(super) fn in_flight(scene: &'s Scene, planned: usize, seen: &'s [Seen]) -> Self {
        Self::of(scene, planned, Known::Seen(seen.into()))
    }

    /// The axes at the end of the run alone, in these states of all bodies.
    pub(super) fn at_end(
        scene: &'s Scene,
        planned: usize,
        bodies: &'s [RigidBody],
        states: &'s [BodyState],
    ) -> Self {
        Self::of(scene, planned, Known::End(bodies, states))
    }

    fn of(scene: &'s Scene, planned: usize, states: Known<'s>) -> Self {
        Self {
            scene,
            planned,
            states,
            known: Vec::new(),
        }
    }

    /// Returns the axes that the table at `key` asks for, at the start of the run and at the end of each step, or at its end
    /// alone. Before the first step that has been seen, they are those of that step.
    pub(super) fn axes(
        &mut self,
        key: &str,
        file: &'s RelativeFile,
    ) -> Result<Arc<[Axes]>, SceneError> {
        if let Some((_, axes)) = self.known.iter().find(|(known, _)| *known == file) {
            return Ok(Arc::clone(axes));
        }
        let axes: Arc<[Axes]> = match &self.states {
            Known::Seen(seen) => {
                let flown = Flown::new(self.scene, self.planned, key, file)?;
                flown.axes(seen)?.into()
            }
            Known::End(rigid, states) => {
                let indices = bodies(self.scene, self.planned, key, file)?;
                let motion = |index: usize| Motion::of(&rigid[index], &states[index]);
                let motions = indices.into_iter().map(motion);
                [axes_of(self.scene, key, file, motions)?].into()
            }
        };
        self.known.push((file, Arc::clone(&axes)));
        Ok(axes)
    }
}

/// The bodies that axes belong to, flown as in the run, by the scene's integrator, but without the planned body: it does not
/// act on them.
struct Flown<'s> {
    /// Key of the table that asks for the axes.
    key: &'s str,
    file: &'s RelativeFile,
    /// Indices of the bodies: that at which the axes are, and that in the center of its orbit if it is a body.
    bodies: Vec<usize>,
    alone: Scene,
    scheme: Scheme,
}

impl<'s> Flown<'s> {
    fn new(
        scene: &Scene,
        planned: usize,
        key: &'s str,
        file: &'s RelativeFile,
    ) -> Result<Self, SceneError> {
        let bodies = bodies(scene, planned, key, file)?;
        let each = bodies.iter();
        let alone = Scene {
            bodies: each.map(|index| scene.bodies[*index].clone()).collect(),
            gravity: SceneGravity {
                mutual: None,
                ..scene.gravity.clone()
            },
            docking: Vec::new(),
            maneuver: None,
            ..scene.clone()
        };
        let Integration::Method(method) = scene.integration else {
            return Err(unforeseen(key, file, "the integrator is not chosen"));
        };
        if scene.steps.saturating_mul(u64::from(scene.substeps)) > MOST_STEPS {
            let expected = format!(
                "at most {MOST_STEPS} substeps in the run, for axes of a body whose motion is predicted"
            );
            return Err(SceneError::value("run.substeps", scene.substeps, expected));
        }
        Ok(Self {
            key,
            file,
            bodies,
            scheme: alone.scheme_by(method, scene.substeps),
            alone,
        })
    }

    /// The axes at the start of the run and at the end of each step: where the bodies have been seen, and from there on where
    /// they fly.
    fn axes(&self, seen: &[Seen]) -> Result<Vec<Axes>, SceneError> {
        let steps = self.alone.steps;
        let loads = vec![Load::default(); self.bodies.len()];
        let mut all = Vec::with_capacity(steps as usize + 1);
        for (index, Seen { step, states }) in seen.iter().enumerate() {
            let next = seen.get(index + 1).map_or(steps + 1, |next| next.step);
            let next = next.min(steps + 1);
            if *step > steps || next <= *step {
                continue;
            }
            let states: Vec<_> = self.bodies.iter().map(|body| states[*body]).collect();
            let first = self.at(&states)?;
            all.resize(*step as usize, first);
            all.push(first);
            if next == step + 1 {
                continue;
            }
            let refuse = |error: String| unforeseen(self.key, self.file, &error);
            let mut simulation = self
                .alone
                .simulation_from(states, self.scheme)
                .map_err(|error| refuse(error.to_string()))?;
            for _ in step + 1..next {
                simulation
                    .advance(&loads)
                    .map_err(|error| refuse(self.alone.step_error(&error)))?;
                all.push(self.at(simulation.states())?);
            }
        }
        Ok(all)
    }

    /// The axes in these states of the bodies.
    fn at(&self, states: &[BodyState]) -> Result<Axes, SceneError> {
        let motions = self.alone.bodies.iter().zip(states);
        let motions = motions.map(|(named, state)| Motion::of(&named.body, state));
        axes_of(&self.alone, self.key, self.file, motions)
    }
}

/// The axes of the first of these motions, about the second, if there is one, or the center of the field.
fn axes_of(
    scene: &Scene,
    key: &str,
    file: &RelativeFile,
    mut motions: impl Iterator<Item = Motion>,
) -> Result<Axes, SceneError> {
    let RelativeFile { body, axes, .. } = file;
    let own = motions.next();
    let central = scene.gravity.central.as_ref();
    let fixed = central.map_or_else(Vector3::zeros, |central| central.position);
    let center = motions.next().unwrap_or(Motion::at(fixed));
    own.and_then(|own| Axes::of(*axes, &own, &center))
        .ok_or_else(|| {
            let expected = format!("a body that moves around its center, for {axes} axes");
            SceneError::value(format!("{key}.body"), body, expected)
        })
}

fn unforeseen(key: &str, file: &RelativeFile, error: &str) -> SceneError {
    let expected = format!("a body whose motion can be predicted: {error}");
    SceneError::value(format!("{key}.body"), &file.body, expected)
}

/// Indices of the bodies that axes belong to.
fn bodies(
    scene: &Scene,
    planned: usize,
    key: &str,
    file: &RelativeFile,
) -> Result<Vec<usize>, SceneError> {
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
    let mut bodies = vec![other("body", body)?];
    let orbital = matches!(axes, AxesFile::Rtn | AxesFile::Lvlh);
    match (about, &scene.gravity.central) {
        (Some(about), _) if orbital => bodies.push(other("about", about)?),
        (Some(about), _) => {
            let expected = format!("none beside {axes} axes, which have no center");
            return Err(SceneError::value(key("about"), about, expected));
        }
        (None, None) if orbital => {
            let expected = "the name of the body in the center, as there is no `gravity.central`";
            return Err(SceneError::missing(key("about"), expected));
        }
        (None, _) => {}
    }
    Ok(bodies)
}

impl From<&Axes> for FrameMotion {
    fn from(axes: &Axes) -> Self {
        Self {
            pose: FramePose {
                origin: axes.origin,
                rotation: axes.rotation,
            },
            velocity: axes.velocity,
            turn: axes.rotation * axes.turn,
        }
    }
}
