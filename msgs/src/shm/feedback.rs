#[cfg(feature = "iceoryx2")]
use iceoryx2::prelude::ZeroCopySend;

use super::{BodySample, ControlHeader, ControlInterval, ConversionError};
use crate::excerpt;
use crate::msg::{BodyState, ControlLimits, ControlSequence};

/// Rows of a gain: force (inertial) and moment (body).
const ROWS: usize = 6;

/// Columns of a gain: the deviation `[x − x*, γ − γ*, log(R*ᵀR), Π − Π*]`.
const COLUMNS: usize = 12;

/// Bounds of a control: each component in magnitude, and the norms. Infinity is no bound.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "iceoryx2", derive(ZeroCopySend))]
#[cfg_attr(feature = "iceoryx2", type_name("lgvi/ControlLimits"))]
pub struct Limits {
    /// Of the force's components, inertial frame (N).
    pub force: [f64; 3],
    /// Of the moment's components, body frame (N m).
    pub moment: [f64; 3],
    /// Of the force's norm (N).
    pub force_norm: f64,
    /// Of the moment's norm (N m).
    pub moment_norm: f64,
}

/// Which body a control sequence with a feedback law acts on, when, and within which limits; user header of a slice of
/// [`FeedbackInterval`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "iceoryx2", derive(ZeroCopySend))]
#[cfg_attr(feature = "iceoryx2", type_name("lgvi/FeedbackHeader"))]
pub struct FeedbackHeader {
    /// The sequence.
    pub control: ControlHeader,
    /// Of the corrected control.
    pub limits: Limits,
}

/// A control with its correction: `u = u* − K δz` over one integration step, where
/// `δz = [x − x*, γ − γ*, log(R*ᵀR), Π − Π*]` at the start of the step.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "iceoryx2", derive(ZeroCopySend))]
#[cfg_attr(feature = "iceoryx2", type_name("lgvi/FeedbackInterval"))]
pub struct FeedbackInterval {
    /// `u*`.
    pub control: ControlInterval,
    /// `x*, γ*, R*, Π*`, with the name of the controlled body.
    pub reference: BodySample,
    /// `K`: by rows force (inertial) and moment (body), by columns `δz`, all in SI.
    pub gain: [[f64; COLUMNS]; ROWS],
}

impl Limits {
    /// No bounds.
    pub const NONE: Self = Self {
        force: [f64::INFINITY; 3],
        moment: [f64::INFINITY; 3],
        force_norm: f64::INFINITY,
        moment_norm: f64::INFINITY,
    };
}

impl Default for Limits {
    fn default() -> Self {
        Self::NONE
    }
}

impl FeedbackHeader {
    /// Makes the message of a control sequence whose inertial frame is `frame_id`.
    ///
    /// # Errors
    /// A stamp that ROS time cannot hold.
    pub fn to_message(
        &self,
        intervals: &[FeedbackInterval],
        frame_id: &str,
    ) -> Result<ControlSequence, ConversionError> {
        let controls: Vec<_> = intervals.iter().map(|interval| interval.control).collect();
        Ok(ControlSequence {
            reference: intervals
                .iter()
                .map(|interval| BodyState::from(&interval.reference))
                .collect(),
            feedback: intervals
                .iter()
                .flat_map(|interval| interval.gain.as_flattened())
                .copied()
                .collect(),
            limits: (&self.limits).into(),
            ..self.control.to_message(&controls, frame_id)?
        })
    }

    /// Takes a control sequence with its feedback law from its message; `None` if it is one without, an open loop.
    ///
    /// # Errors
    /// As [`ControlHeader::from_message`]; numbers of references or gains that do not fit that of forces; a reference's
    /// name that does not fit.
    pub fn from_message(
        message: &ControlSequence,
    ) -> Result<Option<(Self, Vec<FeedbackInterval>)>, ConversionError> {
        let (control, controls) = ControlHeader::from_message(message)?;
        let ControlSequence {
            reference,
            feedback,
            limits,
            ..
        } = message;
        if reference.is_empty() && feedback.is_empty() {
            return Ok(None);
        }
        let intervals = controls.len();
        for (field, found, each) in [
            ("reference", reference.len(), 1),
            ("feedback", feedback.len(), ROWS * COLUMNS),
        ] {
            let expected = each * intervals;
            if found != expected {
                return Err(ConversionError::LawLength {
                    body: excerpt(&message.body),
                    field,
                    found,
                    expected,
                    intervals,
                });
            }
        }
        let (rows, _) = feedback.as_chunks::<COLUMNS>();
        let (gains, _) = rows.as_chunks::<ROWS>();
        let intervals = controls.iter().zip(reference).zip(gains);
        let intervals = intervals
            .map(|((control, reference), gain)| {
                Ok(FeedbackInterval {
                    control: *control,
                    reference: BodySample::try_from(reference)?,
                    gain: *gain,
                })
            })
            .collect::<Result<_, ConversionError>>()?;
        let limits = limits.into();
        Ok(Some((Self { control, limits }, intervals)))
    }
}

impl From<&Limits> for ControlLimits {
    fn from(limits: &Limits) -> Self {
        Self {
            force: limits.force,
            moment: limits.moment,
            force_norm: limits.force_norm,
            moment_norm: limits.moment_norm,
        }
    }
}

impl From<&ControlLimits> for Limits {
    fn from(message: &ControlLimits) -> Self {
        Self {
            force: message.force,
            moment: message.moment,
            force_norm: message.force_norm,
            moment_norm: message.moment_norm,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cdr;
    use crate::shm::Name;

    fn sample() -> (FeedbackHeader, Vec<FeedbackInterval>) {
        let body = Name::try_from("chaser").unwrap();
        let header = FeedbackHeader {
            control: ControlHeader {
                body,
                first_step: 12,
                step_size: 0.1,
                stamp_nanoseconds: 1_000_000_001,
            },
            limits: Limits {
                force: [1.0, f64::INFINITY, 3.0],
                moment_norm: 0.5,
                ..Limits::NONE
            },
        };
        let interval = |k: u32| {
            let number = |i: usize| f64::from(k) + i as f64 / 3.0;
            FeedbackInterval {
                control: ControlInterval {
                    force: std::array::from_fn(number),
                    moment: std::array::from_fn(|i| -number(i)),
                },
                reference: BodySample {
                    name: body,
                    position: std::array::from_fn(|i| number(i + 3)),
                    linear_momentum: std::array::from_fn(|i| number(i + 6)),
                    attitude: std::array::from_fn(|i| number(i + 9)),
                    angular_momentum: std::array::from_fn(|i| number(i + 18)),
                },
                gain: std::array::from_fn(|i| std::array::from_fn(|j| number(100 * i + j))),
            }
        };
        (header, (0..3).map(interval).collect())
    }

    #[test]
    fn a_law_survives_its_message() {
        let (header, intervals) = sample();
        let message = header.to_message(&intervals, "inertial").unwrap();
        assert_eq!(message.feedback.len(), 3 * 72);
        // Row 4, column 7 of interval 2.
        assert_eq!(
            message.feedback[2 * 72 + 4 * 12 + 7],
            intervals[2].gain[4][7]
        );
        let message: ControlSequence = cdr::decode(&cdr::encode(&message).unwrap()).unwrap();
        let returned = FeedbackHeader::from_message(&message).unwrap();
        assert_eq!(returned, Some((header, intervals)));
    }

    #[test]
    fn what_has_no_law_is_an_open_loop() {
        let (header, intervals) = sample();
        let mut message = header.to_message(&intervals, "inertial").unwrap();
        message.reference.clear();
        message.feedback.clear();
        assert_eq!(FeedbackHeader::from_message(&message), Ok(None));
    }

    #[test]
    fn half_a_law_is_refused() {
        let (header, intervals) = sample();
        let message = header.to_message(&intervals, "inertial").unwrap();
        let refused = |change: fn(&mut ControlSequence)| {
            let mut message = message.clone();
            change(&mut message);
            match FeedbackHeader::from_message(&message) {
                Err(ConversionError::LawLength {
                    field,
                    found,
                    expected,
                    ..
                }) => (field, found, expected),
                other => panic!("{other:?}"),
            }
        };
        let found = refused(|message| {
            message.feedback.pop();
        });
        assert_eq!(found, ("feedback", 215, 216));
        assert_eq!(
            refused(|message| message.feedback.clear()),
            ("feedback", 0, 216)
        );
        assert_eq!(
            refused(|message| message.reference.clear()),
            ("reference", 0, 3)
        );
        let found = refused(|message| message.reference.push(BodyState::default()));
        assert_eq!(found, ("reference", 4, 3));
    }
}
