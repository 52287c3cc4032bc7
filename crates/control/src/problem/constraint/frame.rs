//! Frames that move, and what is known at the ends of intervals taken in between.

use std::f64::consts::FRAC_PI_4;

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

    /// The pose at the part `part` of the interval that begins at `poses[index]`.
    ///
    /// Origin and rotation vector are cubics through the four nearest poses. A frame that turns by more than 45° in the
    /// interval turns at a constant rate in it.
    pub(super) fn between(poses: &[Self], index: usize, part: f64) -> Self {
        let from = poses[index];
        let turn = |to: &Self| log(&from.rotation.tr_mul(&to.rotation));
        let origin = from.origin + cubic(poses, index, part, |pose| pose.origin - from.origin);
        let next = turn(&poses[index + 1]);
        let turned = if next.norm() > FRAC_PI_4 {
            part * next
        } else {
            cubic(poses, index, part, turn)
        };
        Self {
            origin,
            rotation: from.rotation * exp(&turned),
        }
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
