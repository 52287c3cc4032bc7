//! The errors of sensors, and the messages of what they measure.
//!
//! The errors of measurement `k` depend on the sensor's seed and on `k` alone.

mod gnss;
mod inertial;
mod relative_pose;
mod star_tracker;

pub(crate) use gnss::GnssErrors;
pub(crate) use inertial::ImuErrors;
pub(crate) use relative_pose::RelativePoseErrors;
pub(crate) use star_tracker::StarTrackerErrors;

use lgvi_lie::to_quaternion;
use lgvi_msgs::geometry_msgs::{Point, Quaternion, Vector3 as Components};
use nalgebra::{Matrix3, Vector3};

fn components(vector: Vector3<f64>) -> Components {
    let [x, y, z] = vector.into();
    Components { x, y, z }
}

fn point(vector: Vector3<f64>) -> Point {
    let [x, y, z] = vector.into();
    Point { x, y, z }
}

fn quaternion(attitude: &Matrix3<f64>) -> Quaternion {
    let (w, u) = to_quaternion(attitude);
    let [x, y, z] = u.into();
    Quaternion { x, y, z, w }
}

/// The covariance of independent components with these variances, by rows.
fn diagonal<const N: usize, const ELEMENTS: usize>(variances: [f64; N]) -> [f64; ELEMENTS] {
    let mut covariance = [0.0; ELEMENTS];
    let diagonal = covariance.iter_mut().step_by(N + 1);
    for (element, variance) in diagonal.zip(variances) {
        *element = variance;
    }
    covariance
}
