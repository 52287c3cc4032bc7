use lgvi_lie::exp;
use lgvi_msgs::geometry_msgs::{Pose, PoseWithCovariance, PoseWithCovarianceStamped};
use lgvi_msgs::std_msgs::Header;
use lgvi_scene::{RelativePose, Stream, Units};
use nalgebra::{Matrix3, Vector3};

use super::{diagonal, point, quaternion};

/// The errors of a sensor of the pose of another body: it measures `x + n` and `exp(m) R`, in its own axes.
pub(crate) struct RelativePoseErrors {
    position: f64,
    position_per_range: f64,
    attitude: f64,
    noise: [Stream; 2],
}

impl RelativePoseErrors {
    pub(crate) fn new(camera: &RelativePose, seed: u64) -> Self {
        Self {
            position: camera.position,
            position_per_range: camera.position_per_range,
            attitude: camera.attitude,
            noise: [0, 1].map(|number| Stream::new(seed, number)),
        }
    }

    /// The message of measurement `k`. Its covariance is that at the distance that is measured.
    pub(crate) fn message(
        &self,
        units: &Units,
        header: Header,
        k: u64,
        position: &Vector3<f64>,
        attitude: &Matrix3<f64>,
    ) -> PoseWithCovarianceStamped {
        let deviation =
            |distance: f64| libm::hypot(self.position, self.position_per_range * distance);
        let [of_position, of_attitude] = [&self.noise[0], &self.noise[1]].map(|noise| noise.at(k));
        let measured = position + deviation(position.norm()) * of_position;
        let deviation = deviation(measured.norm()) * units.length;
        let (x, turn) = (deviation * deviation, self.attitude * self.attitude);
        PoseWithCovarianceStamped {
            header,
            pose: PoseWithCovariance {
                pose: Pose {
                    position: point(measured * units.length),
                    orientation: quaternion(&(exp(&(self.attitude * of_attitude)) * attitude)),
                },
                covariance: diagonal::<6, 36>([x, x, x, turn, turn, turn]),
            },
        }
    }
}
