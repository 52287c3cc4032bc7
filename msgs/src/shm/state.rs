#[cfg(feature = "iceoryx2")]
use iceoryx2::prelude::ZeroCopySend;

use super::{ConversionError, Name, NameError};
use crate::{
    msg::{BodyState, SystemState},
    stamp,
    std_msgs::Header,
};

/// What all bodies of one state share; user header of a slice of [`BodySample`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "iceoryx2", derive(ZeroCopySend))]
#[cfg_attr(feature = "iceoryx2", type_name("lgvi/StateHeader"))]
pub struct StateHeader {
    /// Counts the samples of one run from 0 without gaps: a gap is a loss.
    pub sequence: u64,
    /// Integration steps since the scene's epoch.
    pub step: u64,
    /// Time since the scene's epoch, `step * h` (s).
    pub time: f64,
    /// Simulation time since the UNIX epoch (ns).
    pub stamp_nanoseconds: i64,
}

/// State of one body, as the integrator holds it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "iceoryx2", derive(ZeroCopySend))]
#[cfg_attr(feature = "iceoryx2", type_name("lgvi/BodySample"))]
pub struct BodySample {
    /// The body's name in the scene.
    pub name: Name,
    /// x: center of mass, inertial frame (m).
    pub position: [f64; 3],
    /// γ: linear momentum, inertial frame (kg m/s).
    pub linear_momentum: [f64; 3],
    /// R: body to inertial, row-major.
    pub attitude: [f64; 9],
    /// Π: angular momentum about the center of mass, body frame (kg m²/s).
    pub angular_momentum: [f64; 3],
}

impl BodySample {
    /// The numbers of a message, without the body's name.
    pub fn unnamed(message: &BodyState) -> Self {
        Self {
            name: Name::default(),
            position: message.position,
            linear_momentum: message.linear_momentum,
            attitude: message.attitude,
            angular_momentum: message.angular_momentum,
        }
    }

    /// Whether all numbers are finite.
    pub fn is_finite(&self) -> bool {
        let vectors = [self.position, self.linear_momentum, self.angular_momentum];
        let mut numbers = vectors.as_flattened().iter().chain(&self.attitude);
        numbers.all(|number| number.is_finite())
    }
}

impl StateHeader {
    /// Makes the message of a state given in the inertial frame `frame_id`.
    ///
    /// # Errors
    /// A stamp that ROS time cannot hold.
    pub fn to_message(
        &self,
        bodies: &[BodySample],
        frame_id: &str,
    ) -> Result<SystemState, ConversionError> {
        Ok(SystemState {
            header: Header {
                stamp: stamp::to_message(self.stamp_nanoseconds)?,
                frame_id: frame_id.to_owned(),
            },
            sequence: self.sequence,
            step: self.step,
            time: self.time,
            bodies: bodies.iter().map(BodyState::from).collect(),
        })
    }

    /// Makes `message` that of [`to_message`](Self::to_message) in its present frame. Where it has held a state of the
    /// same bodies before, nothing is allocated.
    ///
    /// # Errors
    /// A stamp that ROS time cannot hold.
    pub fn update_message(
        &self,
        bodies: &[BodySample],
        message: &mut SystemState,
    ) -> Result<(), ConversionError> {
        message.header.stamp = stamp::to_message(self.stamp_nanoseconds)?;
        message.sequence = self.sequence;
        message.step = self.step;
        message.time = self.time;
        message.bodies.resize_with(bodies.len(), BodyState::default);
        for (body, sample) in message.bodies.iter_mut().zip(bodies) {
            body.name.clear();
            body.name.push_str(sample.name.as_str());
            body.position = sample.position;
            body.linear_momentum = sample.linear_momentum;
            body.attitude = sample.attitude;
            body.angular_momentum = sample.angular_momentum;
        }
        Ok(())
    }

    /// Takes a state from its message; the frame is the reader's to check.
    ///
    /// # Errors
    /// An invalid stamp, or a body's name that does not fit.
    pub fn from_message(message: &SystemState) -> Result<(Self, Vec<BodySample>), ConversionError> {
        let header = Self {
            sequence: message.sequence,
            step: message.step,
            time: message.time,
            stamp_nanoseconds: stamp::from_message(&message.header.stamp)?,
        };
        let bodies = message
            .bodies
            .iter()
            .map(BodySample::try_from)
            .collect::<Result<_, _>>()?;
        Ok((header, bodies))
    }
}

impl From<&BodySample> for BodyState {
    fn from(sample: &BodySample) -> Self {
        Self {
            name: sample.name.as_str().to_owned(),
            position: sample.position,
            linear_momentum: sample.linear_momentum,
            attitude: sample.attitude,
            angular_momentum: sample.angular_momentum,
        }
    }
}

impl TryFrom<&BodyState> for BodySample {
    type Error = NameError;

    fn try_from(message: &BodyState) -> Result<Self, NameError> {
        Ok(Self {
            name: Name::try_from(&*message.name)?,
            ..Self::unnamed(message)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cdr;

    /// Numbers that a careless conversion changes.
    const AWKWARD: [u64; 9] = [
        0x7ff8_0000_dead_beef, // quiet NaN with payload
        0x7ff0_0000_0000_0001, // signaling NaN
        0xfff8_0000_0000_0000, // negative NaN
        0x8000_0000_0000_0000, // -0
        0x0000_0000_0000_0001, // smallest denormal
        0x800f_ffff_ffff_ffff, // largest negative denormal
        0x7ff0_0000_0000_0000, // infinity
        0x7fef_ffff_ffff_ffff, // largest number
        0x3fb9_9999_9999_999a, // 0.1
    ];

    fn sample() -> (StateHeader, Vec<BodySample>) {
        let number = |index: usize| f64::from_bits(AWKWARD[index % AWKWARD.len()]);
        let header = StateHeader {
            sequence: u64::MAX,
            step: 7,
            time: number(0),
            stamp_nanoseconds: 1_234_567_890_123_456_789,
        };
        let body = |name: &str, shift: usize| BodySample {
            name: Name::try_from(name).unwrap(),
            position: std::array::from_fn(|index| number(index + shift)),
            linear_momentum: std::array::from_fn(|index| number(index + shift + 3)),
            attitude: std::array::from_fn(|index| number(index + shift)),
            angular_momentum: std::array::from_fn(|index| number(index + shift + 6)),
        };
        (header, vec![body("chaser", 0), body("target", 5)])
    }

    fn bits(header: &StateHeader, bodies: &[BodySample]) -> Vec<u64> {
        let bodies = bodies.iter().flat_map(|body| {
            let vectors = [body.position, body.linear_momentum, body.angular_momentum];
            vectors.into_iter().flatten().chain(body.attitude)
        });
        std::iter::once(header.time)
            .chain(bodies)
            .map(f64::to_bits)
            .collect()
    }

    #[test]
    fn every_bit_survives_message_and_cdr() {
        let (header, bodies) = sample();
        let message = header.to_message(&bodies, "inertial").unwrap();
        let message: SystemState = cdr::decode(&cdr::encode(&message).unwrap()).unwrap();
        let (returned_header, returned_bodies) = StateHeader::from_message(&message).unwrap();

        assert_eq!(message.header.frame_id, "inertial");
        assert_eq!(
            bits(&returned_header, &returned_bodies),
            bits(&header, &bodies)
        );
        assert_eq!(
            StateHeader {
                time: 0.0,
                ..returned_header
            },
            StateHeader {
                time: 0.0,
                ..header
            }
        );
        let names: Vec<_> = returned_bodies
            .iter()
            .map(|body| body.name.as_str())
            .collect();
        assert_eq!(names, ["chaser", "target"]);
    }

    #[test]
    fn a_message_that_is_updated_is_as_one_that_is_made() {
        let (header, bodies) = sample();
        let mut message = StateHeader::default()
            .to_message(&[bodies[1], bodies[0], bodies[1]], "inertial")
            .unwrap();
        header.update_message(&bodies, &mut message).unwrap();
        let made = header.to_message(&bodies, "inertial").unwrap();
        let mut appended = vec![7; 3];
        cdr::encode_into(&mut appended, &message).unwrap();
        assert_eq!(appended[3..], cdr::encode(&made).unwrap());
    }

    #[test]
    fn refuses_a_body_name_that_does_not_fit() {
        let (header, bodies) = sample();
        let mut message = header.to_message(&bodies, "inertial").unwrap();
        message.bodies[1].name.clear();
        assert_eq!(
            StateHeader::from_message(&message),
            Err(NameError::Empty.into())
        );
    }
}
