#[cfg(feature = "iceoryx2")]
use iceoryx2::prelude::ZeroCopySend;

use super::{ConversionError, Limits, Name};
use crate::{excerpt, geometry_msgs::Vector3, msg::ControlSequence, stamp, std_msgs::Header};

/// Which body a control sequence acts on and when; user header of an open-loop sequence, a slice of [`ControlInterval`].
///
/// Interval `k` acts from step `first_step + k` to `first_step + k + 1`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "iceoryx2", derive(ZeroCopySend))]
#[cfg_attr(feature = "iceoryx2", type_name("lgvi/ControlHeader"))]
pub struct ControlHeader {
    /// The controlled body's name in the scene.
    pub body: Name,
    /// Integration step at which the first interval starts.
    pub first_step: u64,
    /// h: length of each interval (s).
    pub step_size: f64,
    /// Simulation time since the UNIX epoch at which the first interval starts (ns).
    pub stamp_nanoseconds: i64,
}

/// Force and moment held over one integration step.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "iceoryx2", derive(ZeroCopySend))]
#[cfg_attr(feature = "iceoryx2", type_name("lgvi/ControlInterval"))]
pub struct ControlInterval {
    /// uᶠ: force, inertial frame (N).
    pub force: [f64; 3],
    /// uᵐ: moment about the center of mass, body frame (N m).
    pub moment: [f64; 3],
}

impl ControlHeader {
    /// Makes the message of a control sequence whose forces are given in the inertial frame `frame_id`.
    ///
    /// # Errors
    /// A stamp that ROS time cannot hold.
    pub fn to_message(
        &self,
        intervals: &[ControlInterval],
        frame_id: &str,
    ) -> Result<ControlSequence, ConversionError> {
        Ok(ControlSequence {
            header: Header {
                stamp: stamp::to_message(self.stamp_nanoseconds)?,
                frame_id: frame_id.to_owned(),
            },
            body: self.body.as_str().to_owned(),
            first_step: self.first_step,
            step_size: self.step_size,
            force: intervals
                .iter()
                .map(|interval| vector(interval.force))
                .collect(),
            moment: intervals
                .iter()
                .map(|interval| vector(interval.moment))
                .collect(),
            reference: Vec::new(),
            feedback: Vec::new(),
            limits: (&Limits::NONE).into(),
        })
    }

    /// Takes a control sequence from its message, without the feedback law that it may have; the frame is the reader's to
    /// check.
    ///
    /// # Errors
    /// An invalid stamp, a body's name that does not fit, or unequal numbers of forces and moments.
    pub fn from_message(
        message: &ControlSequence,
    ) -> Result<(Self, Vec<ControlInterval>), ConversionError> {
        let (forces, moments) = (message.force.len(), message.moment.len());
        if forces != moments {
            return Err(ConversionError::LengthMismatch {
                body: excerpt(&message.body),
                forces,
                moments,
            });
        }
        let header = Self {
            body: Name::try_from(&*message.body)?,
            first_step: message.first_step,
            step_size: message.step_size,
            stamp_nanoseconds: stamp::from_message(&message.header.stamp)?,
        };
        let intervals = message
            .force
            .iter()
            .zip(&message.moment)
            .map(|(force, moment)| ControlInterval {
                force: array(force),
                moment: array(moment),
            })
            .collect();
        Ok((header, intervals))
    }
}

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

fn array(vector: &Vector3) -> [f64; 3] {
    [vector.x, vector.y, vector.z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shm::NameError;

    fn sample() -> (ControlHeader, Vec<ControlInterval>) {
        let header = ControlHeader {
            body: Name::try_from("chaser").unwrap(),
            first_step: 12,
            step_size: 0.1,
            stamp_nanoseconds: 1_000_000_001,
        };
        let intervals = (0..5)
            .map(|k| f64::from(k) * 0.1 - 0.0)
            .map(|u| ControlInterval {
                force: [u, -u, -0.0],
                moment: [f64::MIN_POSITIVE * u, 1.0 / 3.0, u],
            })
            .collect();
        (header, intervals)
    }

    #[test]
    fn message_round_trip() {
        let (header, intervals) = sample();
        let message = header.to_message(&intervals, "inertial").unwrap();
        assert_eq!(message.header.frame_id, "inertial");
        let (returned_header, returned) = ControlHeader::from_message(&message).unwrap();
        assert_eq!(returned_header, header);
        let bits = |intervals: &[ControlInterval]| -> Vec<u64> {
            intervals
                .iter()
                .flat_map(|u| u.force.into_iter().chain(u.moment))
                .map(f64::to_bits)
                .collect()
        };
        assert_eq!(bits(&returned), bits(&intervals));
    }

    #[test]
    fn refuses_unequal_lengths_and_long_names() {
        let (header, intervals) = sample();
        let mut message = header.to_message(&intervals, "inertial").unwrap();
        message.moment.pop();
        assert_eq!(
            ControlHeader::from_message(&message),
            Err(ConversionError::LengthMismatch {
                body: "chaser".to_owned(),
                forces: 5,
                moments: 4
            })
        );
        message.force.pop();
        message.body = "b".repeat(40);
        assert_eq!(
            ControlHeader::from_message(&message),
            Err(NameError::TooLong {
                name: message.body.clone(),
                length: 40
            }
            .into())
        );
    }
}
