use nalgebra::{Matrix3, Vector3};

/// A frame fixed in its parent frame, such as a docking port, a camera or a thruster.
///
/// A frame with the name of the scene's inertial frame instead defines the parent of the inertial frame, which is
/// outside the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Name of the frame.
    pub name: String,
    /// Name of the parent frame.
    pub parent: String,
    /// Origin of the frame, in the parent frame and the scene's units.
    pub position: Vector3<f64>,
    /// Rotation matrix from this frame to the parent's.
    pub attitude: Matrix3<f64>,
}
