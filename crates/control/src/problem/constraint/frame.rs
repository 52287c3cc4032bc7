//! Frames that move, and what is known at the ends of intervals taken in between.

use std::f64::consts::FRAC_PI_4;
use std::sync::Arc;

use lgvi_lie::{exp, log};
use nalgebra::{Matrix3, Vector3};

/// The pose of a moving frame at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FramePose {
    /// `x_f`: origin, inertial frame.
    pub origin: Vector3<f64>,
    /// `R_f`: rotation matrix, from the frame to the inertial frame.
    pub rotation: Matrix3<f64>,
}

/// How a frame moves at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameMotion {
    /// Where it is.
    pub pose: FramePose,
    /// `v_f`: velocity of the origin, inertial frame.
    pub velocity: Vector3<f64>,
    /// `ω`: angular velocity, in inertial axes.
    pub turn: Vector3<f64>,
}

impl FramePose {
    /// The inertial frame.
    pub const INERTIAL: Self = Self {
        origin: Vector3::new(0.0, 0.0, 0.0),
        rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    };

    /// The point of the frame, in the inertial frame.
    pub fn point(&self, point: Vector3<f64>) -> Vector3<f64> {
        self.origin + self.rotation * point
    }

    /// A position of the inertial frame, in this frame.
    pub fn seen(&self, position: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.tr_mul(&(position - self.origin))
    }
}

impl From<FramePose> for FrameMotion {
    /// A frame at rest.
    fn from(pose: FramePose) -> Self {
        Self {
            pose,
            velocity: Vector3::zeros(),
            turn: Vector3::zeros(),
        }
    }
}

impl FrameMotion {
    /// The inertial frame.
    pub const INERTIAL: Self = Self {
        pose: FramePose::INERTIAL,
        velocity: Vector3::new(0.0, 0.0, 0.0),
        turn: Vector3::new(0.0, 0.0, 0.0),
    };

    /// The velocity, in inertial axes, of the point of the frame that is at a position of the inertial frame.
    pub fn velocity_at(&self, position: &Vector3<f64>) -> Vector3<f64> {
        self.velocity + self.turn.cross(&(position - self.pose.origin))
    }

    pub(super) fn is_finite(&self) -> bool {
        let Self {
            pose,
            velocity,
            turn,
        } = self;
        (pose.origin.sum() + pose.rotation.sum() + velocity.sum() + turn.sum()).is_finite()
    }

    /// The motion at the part `part` of the interval that begins at `motions[index]`.
    ///
    /// Origin, rotation vector and both velocities are cubics through the four nearest. A frame that turns by more than 45° in the
    /// interval turns at a constant rate in it.
    pub(super) fn between(motions: &[Self], index: usize, part: f64) -> Self {
        let from = motions[index];
        let pose = from.pose;
        let turn = |to: &Self| log(&pose.rotation.tr_mul(&to.pose.rotation));
        let through = |value: &dyn Fn(&Self) -> Vector3<f64>| cubic(motions, index, part, value);
        let next = turn(&motions[index + 1]);
        let turned = if next.norm() > FRAC_PI_4 {
            part * next
        } else {
            through(&turn)
        };
        Self {
            pose: FramePose {
                origin: pose.origin + through(&|to| to.pose.origin - pose.origin),
                rotation: pose.rotation * exp(&turned),
            },
            velocity: from.velocity + through(&|to| to.velocity - from.velocity),
            turn: from.turn + through(&|to| to.turn - from.turn),
        }
    }
}

/// Positions at `0 … intervals` of the same time, linearly between those given.
pub(crate) fn resampled(orbit: &Arc<[Vector3<f64>]>, intervals: usize) -> Arc<[Vector3<f64>]> {
    let last = orbit.len() - 1;
    let at = |k: usize| {
        let below = (k * last / intervals).min(last - 1);
        let part = (k * last) as f64 / intervals as f64 - below as f64;
        orbit[below].lerp(&orbit[below + 1], part)
    };
    if intervals == last {
        orbit.clone()
    } else {
        (0..=intervals).map(at).collect()
    }
}

/// The cubic through the values at the four points nearest to the part `part` of the interval that begins at
/// `points[index]`; a polynomial of lower degree through fewer points.
pub(crate) fn cubic<T>(
    points: &[T],
    index: usize,
    part: f64,
    value: impl Fn(&T) -> Vector3<f64>,
) -> Vector3<f64> {
    let count = points.len().min(4);
    let first = index.saturating_sub(1).min(points.len() - count);
    let at = (index - first) as f64 + part;
    let nodes = points[first..first + count].iter().enumerate();
    let terms = nodes.map(|(node, point)| {
        let others = (0..count).filter(|other| *other != node);
        let weight = others.fold(1.0, |weight, other| {
            weight * (at - other as f64) / (node as f64 - other as f64)
        });
        weight * value(point)
    });
    terms.sum()
}
