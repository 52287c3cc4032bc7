use nalgebra::{Matrix3, Vector3};

/// The parameters of a gravity model, for code that evaluates it for many systems at once; see [`lanes`](crate::lanes).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Form {
    /// A stationary attractor.
    Attractor {
        /// The attractor in its own frame.
        shape: SourceShape,
        /// Its placement, or `None` if it is at the origin, aligned with the inertial frame.
        placement: Option<Placement>,
    },
    /// A uniform field.
    Uniform {
        /// Acceleration, inertial frame.
        acceleration: Vector3<f64>,
    },
    /// Mutual attraction of all bodies.
    Mutual {
        /// Gravitational constant `G`.
        constant: f64,
    },
}

/// An attractor in its own frame.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum SourceShape {
    /// A point or a sphere.
    Point {
        /// Gravitational parameter `GM`.
        gm: f64,
    },
    /// A point with second moments: `φ = −GM/r − d·Hd/r⁵`.
    Quadrupole {
        /// Gravitational parameter `GM`.
        gm: f64,
        /// `H`, symmetric and trace-free.
        second: Matrix3<f64>,
    },
}

/// Position, attitude and extent of an attractor.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Position of the origin of its frame, in the inertial frame.
    pub position: Vector3<f64>,
    /// Rotation from its frame to the inertial one.
    pub attitude: Matrix3<f64>,
    /// Radius that no body may enter, or 0 if it has none.
    pub radius: f64,
}
