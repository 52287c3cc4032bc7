use lgvi_msgs::geometry_msgs::{Pose, PoseWithCovariance, Twist, TwistWithCovariance};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::std_msgs::Header;
use lgvi_scene::{Gnss, Stream, Units};
use nalgebra::{Matrix3, Vector3};

use super::{components, diagonal, point, quaternion};

/// The variance of what is not measured: nothing is known of it.
const UNKNOWN: f64 = 1e6;

/// The errors of a receiver of satellite navigation.
pub(crate) struct GnssErrors {
    position: f64,
    velocity: f64,
    noise: [Stream; 2],
}

impl GnssErrors {
    pub(crate) fn new(gnss: &Gnss, seed: u64) -> Self {
        Self {
            position: gnss.position,
            velocity: gnss.velocity,
            noise: [0, 1].map(|number| Stream::new(seed, number)),
        }
    }

    /// The message of measurement `k`. Orientation and angular velocity are not measured: the twist is in axes that are
    /// parallel to those of the inertial frame, as the orientation says.
    pub(crate) fn message(
        &self,
        units: &Units,
        header: Header,
        k: u64,
        [position, velocity]: [&Vector3<f64>; 2],
    ) -> Odometry {
        let speed = units.length / units.time;
        let [of_position, of_velocity] = [&self.noise[0], &self.noise[1]].map(|noise| noise.at(k));
        let covariance = |deviation: f64| {
            let variance = deviation * deviation;
            diagonal::<6, 36>([variance, variance, variance, UNKNOWN, UNKNOWN, UNKNOWN])
        };
        Odometry {
            child_frame_id: header.frame_id.clone(),
            header,
            pose: PoseWithCovariance {
                pose: Pose {
                    position: point((position + self.position * of_position) * units.length),
                    orientation: quaternion(&Matrix3::identity()),
                },
                covariance: covariance(self.position * units.length),
            },
            twist: TwistWithCovariance {
                twist: Twist {
                    linear: components((velocity + self.velocity * of_velocity) * speed),
                    ..Default::default()
                },
                covariance: covariance(self.velocity * speed),
            },
        }
    }
}
