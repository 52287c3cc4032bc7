//! Numbers as a browser takes them without parsing: little-endian 64-bit floats in base64, which are the same to the last bit.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use lgvi_lie::to_quaternion;
use nalgebra::{Matrix3, Vector3};
use serde::{Serialize, Serializer};

/// Numbers, one after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Packed(Vec<u8>);

impl Packed {
    pub(super) fn push(&mut self, values: &[f64]) {
        self.0
            .extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    /// The components of vectors, one vector after the other.
    pub(super) fn of<'a>(vectors: impl IntoIterator<Item = &'a Vector3<f64>>) -> Self {
        let mut packed = Self::default();
        for vector in vectors {
            packed.push(vector.as_slice());
        }
        packed
    }
}

impl Serialize for Packed {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&BASE64_STANDARD.encode(&self.0))
    }
}

/// A quaternion `w, x, y, z` of a rotation.
pub(super) fn quaternion(rotation: &Matrix3<f64>) -> [f64; 4] {
    let (w, u) = to_quaternion(rotation);
    [w, u.x, u.y, u.z]
}

/// The poses of a frame over time.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct FrameMotion {
    /// (m), inertial frame.
    position: Packed,
    /// To the inertial frame: w, x, y, z, whose signs do not jump.
    attitude: Packed,
    #[serde(skip)]
    before: [f64; 4],
}

impl FrameMotion {
    /// Adds the next pose.
    pub(super) fn push(&mut self, position: &Vector3<f64>, attitude: &Matrix3<f64>) {
        let mut attitude = quaternion(attitude);
        let along: f64 = attitude.iter().zip(&self.before).map(|(a, b)| a * b).sum();
        if along < 0.0 {
            attitude = attitude.map(|component| -component);
        }
        self.before = attitude;
        self.position.push(position.as_slice());
        self.attitude.push(&attitude);
    }
}
