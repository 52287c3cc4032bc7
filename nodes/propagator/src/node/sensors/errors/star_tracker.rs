use lgvi_lie::exp;
use lgvi_msgs::sensor_msgs;
use lgvi_msgs::std_msgs::Header;
use lgvi_scene::{StarTracker, Stream};
use nalgebra::{Matrix3, Vector3};

use super::{diagonal, quaternion};

/// The errors of a star tracker: it measures `R exp(n)`, with `n` in its own axes.
pub(crate) struct StarTrackerErrors {
    deviations: Vector3<f64>,
    noise: Stream,
}

impl StarTrackerErrors {
    pub(crate) fn new(tracker: &StarTracker, seed: u64) -> Self {
        let cross = tracker.cross_boresight;
        Self {
            deviations: Vector3::new(cross, cross, tracker.about_boresight),
            noise: Stream::new(seed, 0),
        }
    }

    /// The message of measurement `k`: an orientation and nothing else.
    pub(crate) fn message(
        &self,
        header: Header,
        k: u64,
        attitude: &Matrix3<f64>,
    ) -> sensor_msgs::Imu {
        let error = self.deviations.component_mul(&self.noise.at(k));
        let variances = self.deviations.component_mul(&self.deviations);
        sensor_msgs::Imu {
            header,
            orientation: quaternion(&(attitude * exp(&error))),
            orientation_covariance: diagonal(variances.into()),
            angular_velocity_covariance: diagonal([-1.0, 0.0, 0.0]),
            linear_acceleration_covariance: diagonal([-1.0, 0.0, 0.0]),
            ..Default::default()
        }
    }
}
