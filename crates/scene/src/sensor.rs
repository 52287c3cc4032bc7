use nalgebra::{Matrix3, Vector3};

use crate::Mount;

/// A sensor that is fixed in a body. Its errors depend on its seed and the number of the measurement alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Name, part of its topic.
    pub name: String,
    /// Index of the body that it is fixed in.
    pub body: usize,
    /// Name of its frame.
    pub frame: String,
    /// Pose of its frame in the body.
    pub mount: Mount,
    /// Steps from one measurement to the next, ≥ 1.
    pub every: u64,
    /// Steps from a measurement to its message.
    pub delay: u64,
    /// Seed of its errors.
    pub seed: u64,
    /// What it measures, and with which errors.
    pub kind: SensorKind,
}

/// What a sensor measures, with the standard deviations of its errors in the scene's units.
#[derive(Clone, Debug, PartialEq)]
pub enum SensorKind {
    /// Angular velocity and specific force.
    Imu(Imu),
    /// Attitude.
    StarTracker(StarTracker),
    /// Position and velocity.
    Gnss(Gnss),
    /// Pose of another body.
    RelativePose(RelativePose),
}

impl SensorKind {
    /// Returns the name of the kind, which is part of its topics.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Imu(_) => "imu",
            Self::StarTracker(_) => "star_tracker",
            Self::Gnss(_) => "gnss",
            Self::RelativePose(_) => "relative_pose",
        }
    }

    /// Returns the ROS type of its messages.
    pub fn message_type(&self) -> &'static str {
        match self {
            Self::Imu(_) | Self::StarTracker(_) => "sensor_msgs/msg/Imu",
            Self::Gnss(_) => "nav_msgs/msg/Odometry",
            Self::RelativePose(_) => "geometry_msgs/msg/PoseWithCovarianceStamped",
        }
    }
}

/// An inertial measurement unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Imu {
    /// Errors of the angular velocity (rad per unit of time).
    pub gyroscope: InertialErrors,
    /// Errors of the specific force.
    pub accelerometer: InertialErrors,
}

/// Errors of three gyroscopes or accelerometers, in the terms of IEEE Std 952.
///
/// A measurement over a period `T` is `(I + E) u + b₀ + b(t) + w(t) + n`, limited to the range in each axis: the true mean
/// `u`, constant bias `b₀`, bias instability `b`, random walk `w` and white noise `n`.
#[derive(Clone, Debug, PartialEq)]
pub struct InertialErrors {
    /// Angle or velocity random walk `N`: white noise has the standard deviation `N/√T`.
    pub noise_density: f64,
    /// Standard deviation of the constant bias.
    pub bias: f64,
    /// Standard deviation of the bias instability, a first-order Gauss–Markov process.
    pub bias_instability: f64,
    /// Its correlation time, > 0.
    pub correlation_time: f64,
    /// Rate or acceleration random walk `K`: the standard deviation after the time `t` is `K √t`.
    pub random_walk: f64,
    /// Errors `E` of scale and alignment.
    pub sensitivity: SensitivityErrors,
    /// Largest size of a component, infinite without limit.
    pub range: f64,
}

/// The matrix `E` of the errors of scale and alignment.
#[derive(Clone, Debug, PartialEq)]
pub enum SensitivityErrors {
    /// The matrix.
    Given(Matrix3<f64>),
    /// Standard deviations of its elements.
    Drawn {
        /// Of those on the diagonal.
        scale_factor: f64,
        /// Of the others (rad).
        misalignment: f64,
    },
}

/// A star tracker, which looks along the z axis of its frame.
#[derive(Clone, Debug, PartialEq)]
pub struct StarTracker {
    /// Standard deviation of the rotation about the x and y axes (rad).
    pub cross_boresight: f64,
    /// Standard deviation of the rotation about the z axis (rad).
    pub about_boresight: f64,
    /// Cones that dazzle it.
    pub exclusions: Vec<Exclusion>,
    /// Angular speed beyond which it does not measure, infinite without limit.
    pub max_rate: f64,
}

/// A cone that the boresight of a star tracker must stay out of.
#[derive(Clone, Debug, PartialEq)]
pub struct Exclusion {
    /// What is in the axis of the cone.
    pub toward: Toward,
    /// Angle of the boresight from the direction, or from the limb of a body that has a radius (rad).
    pub half_angle: f64,
}

/// What a direction points at.
#[derive(Clone, Debug, PartialEq)]
pub enum Toward {
    /// The body of an index.
    Body(usize),
    /// The central attractor.
    Attractor,
    /// Something far away in this direction, a unit vector in the inertial frame.
    Direction(Vector3<f64>),
}

/// A receiver of satellite navigation. Its antenna is at the origin of its frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Gnss {
    /// Standard deviation of each component of the position.
    pub position: f64,
    /// Standard deviation of each component of the velocity.
    pub velocity: f64,
}

/// A sensor of the pose of another body, which looks along the z axis of its frame.
#[derive(Clone, Debug, PartialEq)]
pub struct RelativePose {
    /// Index of the other body.
    pub target: usize,
    /// Largest angle of the target from the z axis, π at most (rad).
    pub field_of_view: f64,
    /// Smallest and largest distance of the target.
    pub range: [f64; 2],
    /// Standard deviation of each component of the position.
    pub position: f64,
    /// Its growth with the distance: the variance is `σ² + (a d)²`.
    pub position_per_range: f64,
    /// Standard deviation of each component of the rotation vector of the attitude (rad).
    pub attitude: f64,
}
