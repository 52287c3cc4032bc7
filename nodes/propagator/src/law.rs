use lgvi_common::{Correction, GAIN, Limits};
use lgvi_dynamics::{BodyState, Load};
use lgvi_lie::orthogonality_error;
use lgvi_msgs::excerpt;
use lgvi_msgs::msg::{self, ControlLimits, ControlSequence};
use lgvi_scene::Units;
use thiserror::Error;

/// How far a reference attitude may be from a rotation, as in scenes: the deviation is as accurate as it is one.
const ROTATION_TOLERANCE: f64 = 1e-9;

/// A feedback law, checked and in the scene's units: `u = u* − K δz`, held within limits, where
/// `δz = [x − x*, γ − γ*, log(R*ᵀR), Π − Π*]` at the start of the interval.
///
/// # Assumptions and limitations
/// - It is linear in `δz`, of first order in the deviation; the angle of `log(R*ᵀR)` jumps at half a turn.
/// - The correction is constant over the interval, whatever substeps the integrator makes of it.
/// - Where it exceeds the limits, components are cut, then force and moment scaled to the bounds of their norms.
#[derive(Clone, Debug, PartialEq)]
pub struct Law {
    /// One an interval.
    corrections: Vec<Correction>,
    limits: Limits,
}

/// Why a feedback law is none.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum LawError {
    /// Not as much of everything as there are intervals.
    #[error(
        "{found} elements in `{field}`, expected {expected} for the {intervals} intervals of the sequence, or an open \
         loop without `reference` and `feedback`"
    )]
    Length {
        /// `reference` or `feedback`.
        field: &'static str,
        /// Its elements.
        found: usize,
        /// What there should be.
        expected: usize,
        /// Intervals of the sequence.
        intervals: usize,
    },
    /// The reference is of another body.
    #[error(
        "`reference[{interval}].name` is {found:?}, expected the sequence's `body`, {expected}"
    )]
    ReferenceBody {
        /// Which interval, from 0.
        interval: usize,
        /// The name in the reference.
        found: String,
        /// The sequence's body.
        expected: String,
    },
    /// NaN or infinity in a reference.
    #[error("`reference[{interval}].{field}` is {value:?}, expected three finite numbers")]
    ReferenceNotFinite {
        /// Which interval, from 0.
        interval: usize,
        /// `position`, `linear_momentum` or `angular_momentum`.
        field: &'static str,
        /// What it says.
        value: [f64; 3],
    },
    /// A reference attitude that is none.
    #[error("`reference[{interval}].attitude` is {value:?}, expected a rotation matrix by rows")]
    ReferenceAttitude {
        /// Which interval, from 0.
        interval: usize,
        /// What it says.
        value: [f64; 9],
    },
    /// NaN, infinity, or a number that is infinite in the scene's units, in a gain.
    #[error("`feedback[{index}]` is {value:?}, expected a finite number")]
    Gain {
        /// Which element, from 0.
        index: usize,
        /// What it says.
        value: f64,
    },
    /// A limit that bounds nothing, or all.
    #[error("`limits.{field}` is {value}, expected a number > 0, infinity for no limit")]
    Limit {
        /// Which limit.
        field: &'static str,
        /// What it says.
        value: f64,
    },
}

impl Law {
    /// The memory that its corrections take (byte).
    pub(crate) fn size(&self) -> usize {
        size_of_val(self.corrections.as_slice())
    }

    /// Checks the law of a received sequence; `None` for an open loop.
    pub(crate) fn check(
        message: &ControlSequence,
        units: &Units,
    ) -> Result<Option<Self>, LawError> {
        let ControlSequence {
            body,
            reference,
            feedback,
            limits,
            ..
        } = message;
        if reference.is_empty() && feedback.is_empty() {
            return Ok(None);
        }
        let intervals = message.force.len();
        for (field, found, each) in [
            ("reference", reference.len(), 1),
            ("feedback", feedback.len(), GAIN),
        ] {
            let expected = each * intervals;
            if found != expected {
                return Err(LawError::Length {
                    field,
                    found,
                    expected,
                    intervals,
                });
            }
        }
        check_limits(limits)?;
        let (gains, _) = feedback.as_chunks();
        let mut corrections = Vec::with_capacity(intervals);
        for (interval, (state, gain)) in reference.iter().zip(gains).enumerate() {
            if state.name != *body {
                return Err(LawError::ReferenceBody {
                    interval,
                    found: excerpt(&state.name),
                    expected: excerpt(body),
                });
            }
            let correction = Correction::from_si(state, gain, units);
            check_reference(interval, state, &correction.reference)?;
            check_gain(interval, gain, &correction)?;
            corrections.push(correction);
        }
        Ok(Some(Self {
            corrections,
            limits: Limits::from_si(limits, units),
        }))
    }

    /// The control `load` of `interval` corrected for the body's `state` at its start.
    pub(crate) fn correct(&self, interval: usize, load: &Load, state: &BodyState) -> Load {
        let Correction { reference, gain } = &self.corrections[interval];
        let correction = gain * lgvi_control::miss(reference, state);
        self.limits.hold(&Load {
            force: load.force - correction.fixed_rows::<3>(0),
            moment: load.moment - correction.fixed_rows::<3>(3),
        })
    }
}

fn check_limits(limits: &ControlLimits) -> Result<(), LawError> {
    let [fx, fy, fz] = limits.force;
    let [mx, my, mz] = limits.moment;
    let named = [
        ("force[0]", fx),
        ("force[1]", fy),
        ("force[2]", fz),
        ("moment[0]", mx),
        ("moment[1]", my),
        ("moment[2]", mz),
        ("force_norm", limits.force_norm),
        ("moment_norm", limits.moment_norm),
    ];
    match named
        .into_iter()
        .find(|(_, value)| value.is_nan() || *value <= 0.0)
    {
        Some((field, value)) => Err(LawError::Limit { field, value }),
        None => Ok(()),
    }
}

fn check_reference(
    interval: usize,
    message: &msg::BodyState,
    reference: &BodyState,
) -> Result<(), LawError> {
    for (field, value, converted) in [
        ("position", message.position, reference.position),
        (
            "linear_momentum",
            message.linear_momentum,
            reference.linear_momentum,
        ),
        (
            "angular_momentum",
            message.angular_momentum,
            reference.angular_momentum,
        ),
    ] {
        if !converted.iter().all(|component| component.is_finite()) {
            return Err(LawError::ReferenceNotFinite {
                interval,
                field,
                value,
            });
        }
    }
    let attitude = &reference.attitude;
    let error = orthogonality_error(attitude);
    if error.is_nan() || error > ROTATION_TOLERANCE || attitude.determinant() < 0.0 {
        let value = message.attitude;
        return Err(LawError::ReferenceAttitude { interval, value });
    }
    Ok(())
}

fn check_gain(
    interval: usize,
    numbers: &[f64; GAIN],
    correction: &Correction,
) -> Result<(), LawError> {
    // By rows.
    let converted = correction.gain.transpose();
    match converted.iter().position(|number| !number.is_finite()) {
        Some(index) => Err(LawError::Gain {
            index: interval * GAIN + index,
            value: numbers[index],
        }),
        None => Ok(()),
    }
}
