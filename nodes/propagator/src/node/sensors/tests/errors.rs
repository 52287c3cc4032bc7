//! The errors of the other sensors over many measurements.

use lgvi_lie::{exp, log};
use lgvi_msgs::geometry_msgs::Quaternion;
use lgvi_msgs::std_msgs::Header;
use lgvi_scene::{Gnss, RelativePose, StarTracker, Units};

use super::super::errors::{GnssErrors, RelativePoseErrors, StarTrackerErrors};
use super::statistics::{COUNT, SI, assert_normal};
use super::*;

fn rotation(q: &Quaternion) -> Matrix3<f64> {
    let s = lgvi_lie::hat(&Vector3::new(q.x, q.y, q.z));
    Matrix3::identity() + 2.0 * (q.w * s + s * s)
}

#[test]
fn a_star_tracker_errs_about_its_own_axes() {
    let tracker = StarTracker {
        cross_boresight: 0.01,
        about_boresight: 0.08,
        exclusions: Vec::new(),
        max_rate: f64::INFINITY,
    };
    let errors = StarTrackerErrors::new(&tracker, 3);
    let attitude = exp(&Vector3::new(0.7, -2.0, 0.4));
    let all = (0..COUNT).map(|k| {
        let message = errors.message(Header::default(), k, &attitude);
        let covariance = message.orientation_covariance;
        assert!((covariance[0] - 1e-4).abs() < 1e-18 && (covariance[8] - 6.4e-3).abs() < 1e-17);
        assert_eq!(
            [
                message.angular_velocity_covariance[0],
                message.linear_acceleration_covariance[0]
            ],
            [-1.0; 2]
        );
        log(&attitude.tr_mul(&rotation(&message.orientation)))
    });
    assert_normal(&all.collect::<Vec<_>>(), [0.01, 0.01, 0.08]);
}

/// In other units: 10 m, 5 s.
#[test]
fn a_receiver_errs_in_the_inertial_axes_and_in_si() {
    let units = Units {
        length: 10.0,
        mass: 3.0,
        time: 5.0,
    };
    let errors = GnssErrors::new(
        &Gnss {
            position: 0.3,
            velocity: 0.1,
        },
        4,
    );
    let (x, v) = (Vector3::new(1.0, 2.0, 3.0), Vector3::new(4.0, 5.0, 6.0));
    let all = (0..COUNT).map(|k| {
        let message = errors.message(&units, Header::default(), k, [&x, &v]);
        let (position, twist) = (message.pose.pose.position, message.twist.twist.linear);
        assert!(
            (message.pose.covariance[7] - 9.0).abs() < 1e-14 && message.pose.covariance[1] == 0.0
        );
        assert!((message.twist.covariance[14] - 0.04).abs() < 1e-16);
        let position = Vector3::new(position.x, position.y, position.z) - 10.0 * x;
        (position, Vector3::new(twist.x, twist.y, twist.z) - 2.0 * v)
    });
    let (positions, velocities): (Vec<_>, Vec<_>) = all.unzip();
    assert_normal(&positions, [3.0; 3]);
    assert_normal(&velocities, [0.2; 3]);
}

#[test]
fn a_relative_position_errs_with_its_distance() {
    let camera = RelativePose {
        target: 1,
        field_of_view: 1.0,
        range: [0.0, f64::INFINITY],
        position: 0.03,
        position_per_range: 0.001,
        attitude: 0.02,
    };
    let errors = RelativePoseErrors::new(&camera, 4);
    let attitude = exp(&Vector3::new(0.2, 0.3, -1.0));
    for (distance, deviation) in [(0.0, 0.03), (40.0, 0.05)] {
        let x = Vector3::new(0.0, 0.0, distance);
        let all = (0..COUNT).map(|k| {
            let message = errors.message(&SI, Header::default(), k, &x, &attitude);
            let (pose, covariance) = (message.pose.pose, message.pose.covariance);
            assert!(
                (covariance[0].sqrt() / deviation - 1.0).abs() < 0.01,
                "{}",
                covariance[0]
            );
            assert!((covariance[35] - 4e-4).abs() < 1e-18);
            let position = Vector3::new(pose.position.x, pose.position.y, pose.position.z);
            (
                position - x,
                log(&(rotation(&pose.orientation) * attitude.transpose())),
            )
        });
        let (positions, turns): (Vec<_>, Vec<_>) = all.unzip();
        assert_normal(&positions, [deviation; 3]);
        assert_normal(&turns, [0.02; 3]);
    }
}
