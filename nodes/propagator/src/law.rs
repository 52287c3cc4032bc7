use lgvi_common::{Correction, DEVIATIONS, GAIN, Limits, body_state, gain_from_si, row_units};
use lgvi_control::{Allocation, Command, MAX_COMMANDS};
use lgvi_dynamics::{BodyState, Load};
use lgvi_lie::orthogonality_error;
use lgvi_msgs::excerpt;
use lgvi_msgs::msg::{self, ControlLimits, ControlSequence};
use lgvi_msgs::shm::BodySample;
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
    /// More actuators than a law can hold within their limits.
    #[error("`feedback` is given for {count} thrusters or wheels, expected at most {MAX_COMMANDS}")]
    Actuators {
        /// Actuators of the body.
        count: usize,
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
        if !is_given(message, message.force.len(), GAIN)? {
            return Ok(None);
        }
        let limits = &message.limits;
        check_limits(limits)?;
        let (gains, _) = message.feedback.as_chunks();
        let mut corrections = Vec::with_capacity(gains.len());
        for (interval, gain) in gains.iter().enumerate() {
            let correction = Correction {
                reference: reference(message, interval, units)?,
                gain: gain_from_si(gain, units),
            };
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

/// A feedback law for thrusters or wheels, checked and in the scene's units: `w = w* − K δz`, where `δz = [x − x*, γ − γ*,
/// log(R*ᵀR), Π − Π*]` at the start of the interval, held within the limits of the actuators: what one of them cannot do others do.
///
/// # Assumptions and limitations
/// Those of [`Law`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ActuatorLaw {
    /// One an interval.
    references: Vec<BodyState>,
    /// By rows an actuator, all rows of an interval after each other.
    rows: Vec<[f64; DEVIATIONS]>,
    allocation: Allocation,
}

impl ActuatorLaw {
    /// Checks the law of a received sequence for so many actuators, whose efforts have a unit; `None` for an open loop.
    pub(crate) fn check(
        message: &ControlSequence,
        [intervals, count]: [usize; 2],
        unit: f64,
        units: &Units,
        allocation: impl FnOnce() -> Option<Allocation>,
    ) -> Result<Option<Self>, LawError> {
        if !is_given(message, intervals, count * DEVIATIONS)? {
            return Ok(None);
        }
        let allocation = allocation().ok_or(LawError::Actuators { count })?;
        let references = 0..message.reference.len();
        let references = references.map(|interval| reference(message, interval, units));
        let each = row_units(unit, units);
        let mut rows = Vec::with_capacity(intervals * count);
        let (given, _) = message.feedback.as_chunks::<DEVIATIONS>();
        for (index, gains) in given.iter().enumerate() {
            let row: [f64; DEVIATIONS] = std::array::from_fn(|column| gains[column] / each[column]);
            if let Some(column) = row.iter().position(|gain| !gain.is_finite()) {
                return Err(LawError::Gain {
                    index: index * DEVIATIONS + column,
                    value: gains[column],
                });
            }
            rows.push(row);
        }
        Ok(Some(Self {
            references: references.collect::<Result<_, _>>()?,
            rows,
            allocation,
        }))
    }

    /// The memory that it takes (byte).
    pub(crate) fn size(&self) -> usize {
        size_of_val(self.references.as_slice()) + size_of_val(self.rows.as_slice())
    }

    /// Corrects the efforts of an interval for the body's `state` at its start.
    pub(crate) fn correct(&self, interval: usize, state: &BodyState, efforts: &mut [f64]) {
        let Some(reference) = self.references.get(interval) else {
            return;
        };
        let deviation = lgvi_control::miss(reference, state);
        let rows = &self.rows[interval * efforts.len()..];
        let mut wanted = Command::zeros();
        for ((wanted, effort), row) in wanted.iter_mut().zip(&*efforts).zip(rows) {
            let each = row.iter().zip(&deviation);
            *wanted = effort - each.map(|(gain, off)| gain * off).sum::<f64>();
        }
        let is_off = |actuator: usize| {
            efforts.get(actuator) == Some(&0.0) && rows[actuator] == [0.0; DEVIATIONS]
        };
        let held = self.allocation.within_limits(&wanted, is_off);
        efforts.copy_from_slice(&held.as_slice()[..efforts.len()]);
    }
}

/// Whether a sequence has a law, with a reference and so many gains for each interval.
fn is_given(message: &ControlSequence, intervals: usize, gains: usize) -> Result<bool, LawError> {
    let lengths = [message.reference.len(), message.feedback.len()];
    if lengths == [0; 2] {
        return Ok(false);
    }
    for (field, found, each) in [
        ("reference", lengths[0], 1),
        ("feedback", lengths[1], gains),
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
    Ok(true)
}

/// The checked reference of an interval.
fn reference(
    message: &ControlSequence,
    interval: usize,
    units: &Units,
) -> Result<BodyState, LawError> {
    let given = &message.reference[interval];
    if given.name != message.body {
        return Err(LawError::ReferenceBody {
            interval,
            found: excerpt(&given.name),
            expected: excerpt(&message.body),
        });
    }
    let state = body_state(&BodySample::unnamed(given), units);
    check_reference(interval, given, &state)?;
    Ok(state)
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
