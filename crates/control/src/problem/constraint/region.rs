use nalgebra::{Matrix3, Vector3};

use super::FrameMotion;

/// The states that a constraint allows, for those who draw it.
///
/// Axes of the body are unit vectors in the body frame. Everything else is in the frame that the constraint is defined in and in
/// the units of the transfer; angles are in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Region {
    /// The center of mass is outside of an ellipsoid.
    OutsideEllipsoid {
        /// Its center.
        center: Vector3<f64>,
        /// Its semi-axes.
        semi_axes: Vector3<f64>,
        /// The rotation matrix from them to the frame.
        axes: Matrix3<f64>,
    },
    /// The center of mass is inside of a sphere.
    InsideSphere {
        /// Its center.
        center: Vector3<f64>,
        /// Its radius.
        radius: f64,
    },
    /// The center of mass is inside of a cone.
    Corridor {
        /// The cone's apex.
        apex: Vector3<f64>,
        /// The unit vector from the apex into the cone.
        axis: Vector3<f64>,
        /// The angle between the axis and the mantle.
        half_angle: f64,
    },
    /// An axis of the body is outside of a cone of directions.
    OutsideCone {
        /// The axis of the body.
        axis: Vector3<f64>,
        /// The unit vector along the cone.
        direction: Vector3<f64>,
        /// The angle between the direction and the mantle.
        half_angle: f64,
    },
    /// A point is within an angle of an axis of the body.
    InSight {
        /// The axis of the body.
        axis: Vector3<f64>,
        /// The point.
        point: Vector3<f64>,
        /// The largest angle.
        half_angle: f64,
    },
    /// A point is not both within an angle of an axis of the body and nearer than a distance.
    OutsidePlume {
        /// The axis of the body.
        axis: Vector3<f64>,
        /// The point.
        point: Vector3<f64>,
        /// The angle.
        half_angle: f64,
        /// The distance.
        distance: f64,
    },
    /// The angular velocity, or its component along an axis of the body, is limited.
    AngularRate {
        /// The axis of the body, if the limit is about one.
        axis: Option<Vector3<f64>>,
        /// The largest rate.
        limit: f64,
    },
    /// The speed of the center of mass, relative to a frame, is limited.
    Speed {
        /// The frame.
        frame: FrameMotion,
        /// The largest speed.
        limit: f64,
    },
}

impl Region {
    /// The region of a frame in this motion, in the inertial frame.
    pub fn placed(self, frame: &FrameMotion) -> Self {
        let pose = &frame.pose;
        match self {
            Self::OutsideEllipsoid {
                center,
                semi_axes,
                axes,
            } => Self::OutsideEllipsoid {
                center: pose.point(center),
                semi_axes,
                axes: pose.rotation * axes,
            },
            Self::InsideSphere { center, radius } => Self::InsideSphere {
                center: pose.point(center),
                radius,
            },
            Self::Corridor {
                apex,
                axis,
                half_angle,
            } => Self::Corridor {
                apex: pose.point(apex),
                axis: pose.rotation * axis,
                half_angle,
            },
            Self::OutsideCone {
                axis,
                direction,
                half_angle,
            } => Self::OutsideCone {
                axis,
                direction: pose.rotation * direction,
                half_angle,
            },
            Self::InSight {
                axis,
                point,
                half_angle,
            } => Self::InSight {
                axis,
                point: pose.point(point),
                half_angle,
            },
            Self::OutsidePlume {
                axis,
                point,
                half_angle,
                distance,
            } => Self::OutsidePlume {
                axis,
                point: pose.point(point),
                half_angle,
                distance,
            },
            Self::Speed { limit, .. } => Self::Speed {
                frame: *frame,
                limit,
            },
            Self::AngularRate { .. } => self,
        }
    }
}
