use nalgebra::{Matrix3, Vector3};

/// A frame that stays where it is in another one: a docking port, a camera, a thruster.
///
/// The one called like the scene's inertial frame says instead what that frame hangs on: its parent is outside of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Its name.
    pub name: String,
    /// Name of the frame that it stays in.
    pub parent: String,
    /// Its origin, on the parent's axes, in the scene's units.
    pub position: Vector3<f64>,
    /// Rotation matrix from this frame to the parent's.
    pub attitude: Matrix3<f64>,
}
