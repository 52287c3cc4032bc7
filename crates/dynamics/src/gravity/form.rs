use nalgebra::{Matrix3, Vector3};

/// What a gravity is, in numbers, for code that evaluates it for many systems at once; see [`lanes`](crate::lanes).
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// An attractor that does not move.
    Attractor {
        /// What attracts.
        shape: SourceShape,
        /// Where; none at the origin, with the inertial frame's axes.
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
pub enum SourceShape {
    /// A point or a sphere.
    Point {
        /// Gravitational parameter `GM`.
        gm: f64,
    },
    /// With its second moments: `φ = −GM/r − d·Hd/r⁵`.
    Quadrupole {
        /// Gravitational parameter `GM`.
        gm: f64,
        /// `H`, symmetric and without trace.
        second: Matrix3<f64>,
    },
}

/// Place, attitude and extent of an attractor.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Origin of its frame, inertial frame.
    pub position: Vector3<f64>,
    /// From its frame to the inertial one.
    pub attitude: Matrix3<f64>,
    /// Radius that no body may enter, 0 for none.
    pub radius: f64,
}
