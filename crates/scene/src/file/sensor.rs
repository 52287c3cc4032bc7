use serde::Deserialize;

use crate::angle::AngleFile;

/// The keys that all sensors have.
pub(crate) struct SensorKeys<'f> {
    pub name: &'f str,
    pub frame: Option<&'f str>,
    pub period: f64,
    pub delay: f64,
    pub seed: Option<u64>,
}

/// Declares the kinds of sensors with their own keys; each has the common keys, too.
macro_rules! kinds {
    ($($(#[$about:meta])* $kind:ident { $($keys:tt)* })*) => {
        #[derive(Deserialize)]
        #[cfg_attr(test, derive(schemars::JsonSchema))]
        #[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
        pub(crate) enum SensorFile {
            $($(#[$about])* $kind {
                /// Name of the sensor, also part of its topic: a letter, then letters, digits and single underscores.
                name: String,
                /// Frame of the sensor: the body's by default, or one of `frames` that is fixed in the body.
                frame: Option<String>,
                /// Time from one measurement to the next, a whole number of steps.
                period: f64,
                /// Time from a measurement to its message, a whole number of steps.
                #[serde(default)]
                delay: f64,
                /// Seed of the errors; by default made of the names of body and sensor and of `run.sensor_seed`.
                seed: Option<u64>,
                $($keys)*
            },)*
        }

        impl SensorFile {
            pub(crate) fn keys(&self) -> SensorKeys<'_> {
                match self {
                    $(Self::$kind { name, frame, period, delay, seed, .. } => SensorKeys {
                        name,
                        frame: frame.as_deref(),
                        period: *period,
                        delay: *delay,
                        seed: *seed,
                    },)*
                }
            }
        }
    };
}

kinds! {
    /// Measures angular velocity and specific force.
    Imu {
        /// Errors of the angular velocity.
        #[serde(default)]
        gyroscope: Box<InertialErrorsFile>,
        /// Errors of the specific force.
        #[serde(default)]
        accelerometer: Box<InertialErrorsFile>,
    }
    /// Measures the attitude of its frame; looks along the z axis.
    StarTracker {
        /// Standard deviation of the rotation about the x and y axes; 0 by default (rad, or a text such as "5 arcsec").
        cross_boresight: Option<AngleFile>,
        /// Standard deviation of the rotation about the z axis; 0 by default (rad, or a text such as "5 arcsec").
        about_boresight: Option<AngleFile>,
        /// Cones that the z axis must stay out of.
        #[serde(default)]
        exclusions: Vec<ExclusionFile>,
        /// Largest angular speed; any by default (rad per unit of time).
        max_rate: Option<f64>,
    }
    /// Measures position and velocity of the origin of its frame.
    Gnss {
        /// Standard deviation of each component of the position.
        #[serde(default)]
        position: f64,
        /// Standard deviation of each component of the velocity.
        #[serde(default)]
        velocity: f64,
    }
    /// Measures the pose of another body in its frame; looks along the z axis.
    RelativePose {
        /// Name of the other body.
        target: String,
        /// Largest angle of the target from the z axis, above 0 to π; any by default (rad, or a text such as "25 deg").
        field_of_view: Option<AngleFile>,
        /// Smallest distance of the target.
        #[serde(default)]
        min_range: f64,
        /// Largest distance of the target; any by default.
        max_range: Option<f64>,
        /// Standard deviation of each component of the position.
        #[serde(default)]
        position: f64,
        /// Growth of that with the distance d: the variance is position² + (position_per_range d)².
        #[serde(default)]
        position_per_range: f64,
        /// Standard deviation of each component of the rotation vector; 0 by default (rad, or a text such as "1 deg").
        attitude: Option<AngleFile>,
    }
}

#[derive(Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct InertialErrorsFile {
    /// Angle or velocity random walk: the standard deviation of white noise over a unit of time.
    pub noise_density: f64,
    /// Standard deviation of the constant bias.
    pub bias: f64,
    /// Standard deviation of the bias instability, a Gauss–Markov process with `correlation_time`.
    pub bias_instability: f64,
    /// Correlation time of the bias instability.
    pub correlation_time: Option<f64>,
    /// Rate or acceleration random walk: the standard deviation of the bias after a unit of time.
    pub random_walk: f64,
    /// Standard deviation of the error of the scale factor.
    pub scale_factor: f64,
    /// Standard deviation of the six angles by which the axes are misaligned; 0 by default (rad, or a text such as "1 arcmin").
    pub misalignment: Option<AngleFile>,
    /// Matrix of the errors of scale and alignment, by rows, in the place of `scale_factor` and `misalignment`.
    pub sensitivity: Option<[[f64; 3]; 3]>,
    /// Largest size of a component; any by default.
    pub range: Option<f64>,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ExclusionFile {
    /// Name of a body in the axis of the cone; without `body` and `direction` it is the central attractor.
    pub body: Option<String>,
    /// Direction of the axis, inertial frame, of any length.
    pub direction: Option<[f64; 3]>,
    /// Smallest angle of the z axis from the direction, or from the limb of a body with a radius, 0 to π (rad, or a text
    /// such as "25 deg").
    pub half_angle: AngleFile,
}
