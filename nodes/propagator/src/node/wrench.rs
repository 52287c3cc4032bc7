//! Wrenches from outside: what acts on a body until another one comes or its time is over.

use std::iter::once;

use lgvi_common::control_sequence;
use lgvi_dynamics::Load;
use lgvi_middleware::Parameters;
use lgvi_middleware::node::NodeError;
use lgvi_msgs::excerpt;
use lgvi_msgs::geometry_msgs::{Vector3 as Components, WrenchStamped};
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::stamp::{self, StampError};
use lgvi_scene::Scene;
use nalgebra::Vector3;
use thiserror::Error;

use crate::Axes;

/// Steps that wrenches may be delayed by: one may wait for each.
const MOST_DELAY: u64 = 100_000;

/// How received wrenches act.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Terms {
    /// Steps after which a wrench is over, ≥ 1.
    hold: u64,
    /// Steps after which it begins.
    delay: u64,
    /// Greatest force (N) and moment (N m).
    limits: [f64; 2],
}

/// A wrench on a body, in the scene's units.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Wrench {
    pub(crate) body: usize,
    /// The time in its header (ns).
    pub(crate) stamp: i64,
    /// Those of force and moment: of the body, the inertial ones, or of another body. The force acts at the center of mass.
    axes: Axes,
    load: Load,
}

/// Why a wrench is not flown.
#[derive(Clone, Debug, Error, PartialEq)]
pub(crate) enum WrenchError {
    /// Bytes that are no message.
    #[error("{0}")]
    Undecodable(String),
    /// A time that is none.
    #[error("`header.stamp`: {0}")]
    Stamp(#[from] StampError),
    /// Axes in which it cannot be understood.
    #[error("`header.frame_id` is {found:?}, expected one of {}", known.join(", "))]
    Frame {
        /// The frame of the wrench.
        found: String,
        /// Those of the body and the inertial one.
        known: Vec<String>,
    },
    /// NaN, infinity, or a number that is infinite in the scene's units.
    #[error("`wrench.{field}` is {value:?}, expected three finite numbers")]
    NotFinite {
        /// `force` or `torque`.
        field: &'static str,
        /// What it says.
        value: [f64; 3],
    },
}

impl Terms {
    /// Those of the node's parameters; `None` where wrenches are not taken.
    pub(crate) fn read(parameters: &Parameters, scene: &Scene) -> Result<Option<Self>, NodeError> {
        let number = |name: &str| parameters.get::<f64>(name);
        let steps = |seconds: f64| (seconds / scene.seconds(1)).round() as u64;
        let (timeout, delay) = (number("wrench_timeout")?, number("wrench_delay")?);
        if steps(delay) > MOST_DELAY {
            let step = scene.seconds(1);
            return Err(NodeError::Input(format!(
                "parameter \"wrench_delay\" is {delay} s, expected at most {MOST_DELAY} steps of {step} s"
            )));
        }
        Ok((timeout > 0.0).then_some(Self {
            // A flight has no more steps.
            hold: steps(timeout).min(scene.steps).max(1),
            delay: steps(delay),
            limits: [number("wrench_max_force")?, number("wrench_max_moment")?],
        }))
    }

    /// How long a command acts (s).
    pub(crate) fn duration(&self, scene: &Scene) -> f64 {
        scene.h() * scene.units.time * self.hold as f64
    }

    /// The same for wrenches that act for `steps` at least.
    pub(crate) fn for_steps(self, steps: u64) -> Self {
        Self {
            hold: self.hold.max(steps),
            ..self
        }
    }

    /// The step from which on a wrench acts that is taken at `step`.
    pub(crate) fn first_step(&self, step: u64) -> u64 {
        step.saturating_add(self.delay)
    }
}

impl Wrench {
    /// Checks a received message for a body of the scene. One without a frame is taken to be in the body's.
    pub(crate) fn of_message(
        scene: &Scene,
        body: usize,
        message: &WrenchStamped,
    ) -> Result<Self, WrenchError> {
        let stamp = stamp::from_message(&message.header.stamp)?;
        let load = scene.units.load_from_si(&Load {
            force: finite("force", &message.wrench.force)?,
            moment: finite("torque", &message.wrench.torque)?,
        });
        let frame = match message.header.frame_id.as_str() {
            "" => &scene.bodies[body].frame,
            given => given,
        };
        let (base, mount) = scene.base(frame);
        let (axes, load) = match Axes::named(scene, base) {
            Some(Axes::Body(own)) if own == body => (Axes::Body(own), mount.load(&load)),
            Some(axes) => (axes, mount.turn(&load)),
            None => {
                return Err(WrenchError::Frame {
                    found: excerpt(frame),
                    known: frames(scene, body),
                });
            }
        };
        let si = scene.units.load_to_si(&load);
        for (field, given, parts) in [
            ("force", &message.wrench.force, [load.force, si.force]),
            ("torque", &message.wrench.torque, [load.moment, si.moment]),
        ] {
            if !parts
                .iter()
                .flatten()
                .all(|component| component.is_finite())
            {
                let value = [given.x, given.y, given.z];
                return Err(WrenchError::NotFinite { field, value });
            }
        }
        Ok(Self {
            body,
            stamp,
            axes,
            load,
        })
    }

    /// The control sequence that it is from `first_step` on.
    ///
    /// # Errors
    /// A stamp that ROS time cannot hold.
    pub(crate) fn sequence(
        &self,
        scene: &Scene,
        terms: &Terms,
        first_step: u64,
    ) -> Result<ControlSequence, StampError> {
        let [force, moment] = terms.limits;
        let units = &scene.units;
        let load = Load {
            force: within(force / units.force(), self.load.force),
            moment: within(moment / units.energy(), self.load.moment),
        };
        let mut sequence = control_sequence(scene, self.body, first_step, &[load], None)?;
        sequence.step_size = terms.duration(scene);
        sequence.header.frame_id = self.axes.frame(scene).to_owned();
        sequence.moment_in_frame = true;
        Ok(sequence)
    }
}

impl Axes {
    /// The name of their frame.
    pub(crate) fn frame(self, scene: &Scene) -> &str {
        match self {
            Self::Split | Self::Inertial => &scene.frame,
            Self::Body(index) => &scene.bodies[index].frame,
        }
    }
}

/// The vector, no longer than `limit`.
fn within(limit: f64, vector: Vector3<f64>) -> Vector3<f64> {
    let largest = vector.amax();
    if largest == 0.0 {
        return vector;
    }
    // The squares of its components might overflow.
    let direction = vector / largest;
    let size = direction.norm();
    if largest * size > limit {
        direction * (limit / size)
    } else {
        vector
    }
}

fn finite(field: &'static str, vector: &Components) -> Result<Vector3<f64>, WrenchError> {
    let value = [vector.x, vector.y, vector.z];
    if value.iter().all(|component| component.is_finite()) {
        Ok(value.into())
    } else {
        Err(WrenchError::NotFinite { field, value })
    }
}

/// The frames in which a wrench on the body may be given: those fixed in it, and all others of the scene.
fn frames(scene: &Scene, body: usize) -> Vec<String> {
    let own: Vec<_> = scene.fixed_frames(body).collect();
    let bodies = scene.bodies.iter().map(|body| &body.frame);
    let fixed = scene.frames.iter().map(|frame| &frame.name);
    let fixed = fixed.filter(|name| **name != scene.frame);
    let others = once(&scene.frame).chain(bodies).chain(fixed);
    let others = others
        .map(String::as_str)
        .filter(|name| !own.contains(name));
    own.iter()
        .copied()
        .chain(others)
        .map(str::to_owned)
        .collect()
}
