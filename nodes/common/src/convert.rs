mod controls;
mod feedback;

use lgvi_dynamics::BodyState;
use lgvi_lie::to_quaternion;
use lgvi_msgs::geometry_msgs::{Point, Pose, Quaternion};
use lgvi_msgs::shm::{BodySample, Name};
use lgvi_msgs::stamp::{self, StampError};
use lgvi_msgs::std_msgs::Header;
use lgvi_scene::{Scene, Units};
use nalgebra::{Matrix3, Vector3};

pub use controls::{Feedback, actuator_sequence, control_sequence};
pub use feedback::{Correction, DEVIATIONS, GAIN, Gain, Limits, gain_from_si, gain_si, row_units};

/// The header of what is true at `step`, in the inertial frame.
pub fn header(scene: &Scene, step: u64) -> Result<Header, StampError> {
    Ok(Header {
        stamp: stamp::to_message(scene.stamp(step))?,
        frame_id: scene.frame.clone(),
    })
}

/// A body's pose in the inertial frame.
pub fn pose(state: &BodyState, units: &Units) -> Pose {
    let [x, y, z] = (state.position * units.length).into();
    let (w, u) = to_quaternion(&state.attitude);
    Pose {
        position: Point { x, y, z },
        orientation: Quaternion {
            x: u.x,
            y: u.y,
            z: u.z,
            w,
        },
    }
}

/// The sample of a body's state.
pub fn body_sample(name: Name, state: &BodyState, units: &Units) -> BodySample {
    let si = units.state_to_si(state);
    let mut attitude = [0.0; 9];
    for (element, value) in attitude.iter_mut().zip(si.attitude.transpose().iter()) {
        *element = *value;
    }
    BodySample {
        name,
        position: si.position.into(),
        linear_momentum: si.linear_momentum.into(),
        attitude,
        angular_momentum: si.angular_momentum.into(),
    }
}

/// The state of a body's sample.
pub fn body_state(sample: &BodySample, units: &Units) -> BodyState {
    BodyState {
        position: Vector3::from(sample.position) / units.length,
        linear_momentum: Vector3::from(sample.linear_momentum) / units.momentum(),
        attitude: Matrix3::from_row_slice(&sample.attitude),
        angular_momentum: Vector3::from(sample.angular_momentum) / units.angular_momentum(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attitude_goes_out_by_rows_and_in_si() {
        let state = BodyState {
            position: Vector3::new(1.0, 2.0, 3.0),
            linear_momentum: Vector3::new(4.0, 5.0, 6.0),
            attitude: Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
            angular_momentum: Vector3::new(7.0, 8.0, 9.0),
        };
        let units = Units {
            length: 10.0,
            mass: 2.0,
            time: 5.0,
        };
        let sample = body_sample(Name::try_from("body").unwrap(), &state, &units);
        assert_eq!(
            sample.attitude,
            [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
        );
        assert_eq!(sample.position, [10.0, 20.0, 30.0]);
        assert_eq!(sample.linear_momentum, [16.0, 20.0, 24.0]);
        assert_eq!(sample.angular_momentum, [280.0, 320.0, 360.0]);
        assert_eq!(body_state(&sample, &units), state);
    }
}
