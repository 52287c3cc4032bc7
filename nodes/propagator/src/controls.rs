use lgvi_dynamics::{BodyState, Load};
use lgvi_msgs::excerpt;
use lgvi_msgs::geometry_msgs::Vector3;
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::stamp::{self, StampError};
use lgvi_scene::Scene;
use thiserror::Error;

use crate::actuation::{Actuation, ActuationError};
use crate::axes::Axes;
use crate::law::{Law, LawError};
use crate::target::Target;

/// Steps that an interval may last: whole numbers up to here are exact.
const MOST_STEPS: f64 = 9_007_199_254_740_992.0;

/// A control sequence for one of a scene's bodies, checked and in the scene's units.
#[derive(Clone, Debug, PartialEq)]
pub struct Controls {
    /// Which body.
    pub body: usize,
    /// The step at which the first interval starts.
    pub first_step: u64,
    /// Steps that an interval lasts, ≥ 1.
    pub hold: u64,
    /// The axes of the loads.
    pub axes: Axes,
    /// One load an interval; none where actuators are commanded.
    pub loads: Vec<Load>,
    /// What commands the body's actuators.
    pub actuation: Option<Actuation>,
    /// What corrects them in flight; none in open loop.
    pub law: Option<Law>,
}

/// Why a control sequence is not flown.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ControlError {
    /// Bytes that are no message.
    #[error("{0}")]
    Undecodable(String),
    /// A sequence needs as many moments as forces.
    #[error("{forces} elements in `force` and {moments} in `moment`, expected the same number")]
    Lengths {
        /// Forces in the sequence.
        forces: usize,
        /// Moments in it.
        moments: usize,
    },
    /// Commands of actuators that are none.
    #[error(transparent)]
    Actuation(#[from] ActuationError),
    /// A time that is none.
    #[error("`header.stamp`: {0}")]
    Stamp(#[from] StampError),
    /// No such body.
    #[error("`body` is {found:?}, expected one of {}", known.join(", "))]
    Body {
        /// The name in the sequence.
        found: String,
        /// The scene's bodies.
        known: Vec<String>,
    },
    /// Axes in which it cannot be understood.
    #[error("`header.frame_id` is {found:?}, expected one of {}", known.join(", "))]
    Frame {
        /// The frame of the sequence.
        found: String,
        /// The scene's inertial frame, and those of bodies.
        known: Vec<String>,
    },
    /// Made for another step.
    #[error(
        "`step_size` is {found} s, expected the scene's step {expected} s or a whole number of them"
    )]
    StepSize {
        /// The length of an interval of the sequence (s).
        found: f64,
        /// The scene's step (s).
        expected: f64,
    },
    /// A feedback law whose intervals are not steps, or whose forces turn with the body.
    #[error(
        "`feedback` is given with `step_size` {found} s, `header.frame_id` {frame:?} and `moment_in_frame` {moment_in_frame}, \
         expected the scene's step {expected} s, its inertial frame, and false"
    )]
    HeldFeedback {
        /// The length of an interval of the sequence (s).
        found: f64,
        /// The frame of the sequence.
        frame: String,
        /// Whether its moments are in that frame.
        moment_in_frame: bool,
        /// The scene's step (s).
        expected: f64,
    },
    /// Nothing in it.
    #[error(
        "`force`, `moment`, `wheel_torque` and `thrust` are empty, expected at least one interval"
    )]
    Empty,
    /// NaN or infinity.
    #[error("`{field}[{interval}]` is {value:?}, expected three finite numbers")]
    NotFinite {
        /// `force` or `moment`.
        field: &'static str,
        /// Which interval, from 0.
        interval: usize,
        /// What it says.
        value: [f64; 3],
    },
    /// Its feedback law is none.
    #[error(transparent)]
    Law(#[from] LawError),
    /// It would have had to start in the past.
    #[error(
        "`first_step` is {first_step}, expected at least {step}, the step that the flight has reached"
    )]
    Late {
        /// The sequence's first step.
        first_step: u64,
        /// The flight's step.
        step: u64,
    },
    /// It would begin when the flight is over.
    #[error("`first_step` is {first_step}, expected less than {steps}, the steps of the scene")]
    Beyond {
        /// The sequence's first step.
        first_step: u64,
        /// The scene's steps.
        steps: u64,
    },
    /// Too many others wait.
    #[error("{limit} other sequences wait to act on the body, expected fewer")]
    TooMany {
        /// How many may wait.
        limit: usize,
    },
    /// The others that wait take too much memory.
    #[error(
        "the sequence takes {size} bytes beside the {kept} of those that wait to act, expected at most {limit} in all"
    )]
    TooLarge {
        /// The sequence's size (byte).
        size: usize,
        /// That of the others (byte).
        kept: usize,
        /// The most that all may take (byte).
        limit: usize,
    },
}

impl Controls {
    /// Checks a received message against the scene. One without a frame is taken to be in the scene's.
    pub fn of_message(scene: &Scene, message: &ControlSequence) -> Result<Self, ControlError> {
        stamp::from_message(&message.header.stamp)?;
        let body = scene
            .body_index(&message.body)
            .ok_or_else(|| ControlError::Body {
                found: excerpt(&message.body),
                known: scene.bodies.iter().map(|body| body.name.clone()).collect(),
            })?;
        let axes = axes(scene, body, message)?;
        let expected = scene.h() * scene.units.time;
        let found = message.step_size;
        let hold = hold(found, expected).ok_or(ControlError::StepSize { found, expected })?;
        let loads = loads(scene, message)?;
        let actuation = Actuation::check(scene, body, message)?;
        if loads.is_empty() && actuation.is_none() {
            return Err(ControlError::Empty);
        }
        let law = match actuation {
            Some(_) => None,
            None => Law::check(message, &scene.units)?,
        };
        let controls = Self {
            body,
            first_step: message.first_step,
            hold,
            axes,
            actuation,
            loads,
            law,
        };
        if controls.has_law() && (hold > 1 || axes != Axes::Split) {
            return Err(ControlError::HeldFeedback {
                found,
                frame: excerpt(&message.header.frame_id),
                moment_in_frame: message.moment_in_frame,
                expected,
            });
        }
        Ok(controls)
    }

    /// The memory that it takes (byte).
    pub(crate) fn size(&self) -> usize {
        let law = self.law.as_ref().map_or(0, Law::size);
        size_of::<Self>()
            + size_of_val(self.loads.as_slice())
            + self.actuation.as_ref().map_or(0, Actuation::size)
            + law
    }

    /// The same without its feedback law.
    pub fn open_loop(self) -> Self {
        Self {
            law: None,
            actuation: self.actuation.map(Actuation::open_loop),
            ..self
        }
    }

    /// Whether a feedback law corrects it in flight.
    pub fn has_law(&self) -> bool {
        self.law.is_some() || self.actuation.as_ref().is_some_and(Actuation::has_law)
    }

    /// The step at which the last interval ends.
    pub fn end(&self) -> u64 {
        let rows = self.actuation.as_ref().map_or(0, Actuation::rows);
        let intervals = self.loads.len().max(rows);
        let length = self.hold.saturating_mul(intervals as u64);
        self.first_step.saturating_add(length)
    }

    /// Writes the efforts of the actuators of the body in `state` during `step`, zero after the last interval. Returns false before the
    /// first one.
    pub fn command(&self, step: u64, state: &BodyState, efforts: &mut [f64]) -> bool {
        let interval = self.interval(step);
        if let (Some(interval), Some(actuation)) = (interval, &self.actuation) {
            actuation.write(interval, state, efforts);
        }
        interval.is_some()
    }

    /// What the sequence acts on.
    pub(crate) fn target(&self) -> Target {
        match &self.actuation {
            Some(actuation) => Target::Actuators(actuation.actuators, self.body),
            None => Target::Body(self.body),
        }
    }

    /// The load during `step`, in the axes of the sequence and without feedback; `None` before the first interval, zero
    /// after the last.
    pub fn during(&self, step: u64) -> Option<Load> {
        let interval = self.interval(step)?;
        Some(self.loads.get(interval).copied().unwrap_or_default())
    }

    fn interval(&self, step: u64) -> Option<usize> {
        let interval = step.checked_sub(self.first_step)? / self.hold;
        Some(usize::try_from(interval).unwrap_or(usize::MAX))
    }

    /// The load during `step` of the body, where all bodies are in `states` at its start: the force in the inertial frame, the
    /// moment in that of the body; `None` before the first interval, zero after the last.
    pub(crate) fn at(&self, step: u64, states: &[BodyState]) -> Option<Load> {
        let interval = self.interval(step)?;
        let Some(load) = self.loads.get(interval) else {
            return Some(Load::default());
        };
        Some(match &self.law {
            Some(law) => law.correct(interval, load, &states[self.body]),
            None => (self.axes).load(self.body, load, |index| states[index].attitude),
        })
    }
}

/// The axes that the frame of a message means for a body; without one, those of the scene.
fn axes(scene: &Scene, body: usize, message: &ControlSequence) -> Result<Axes, ControlError> {
    let frame = &message.header.frame_id;
    let held = message.moment_in_frame;
    match Axes::named(scene, frame) {
        Some(axes) if held => Ok(axes),
        Some(Axes::Inertial) => Ok(Axes::Split),
        Some(Axes::Body(own)) if own == body => Ok(Axes::Body(own)),
        _ => {
            let bodies = scene.bodies.iter().enumerate();
            let bodies = bodies.filter(|(index, _)| held || *index == body);
            let bodies = bodies.map(|(_, body)| &body.frame);
            Err(ControlError::Frame {
                found: excerpt(frame),
                known: std::iter::once(&scene.frame)
                    .chain(bodies)
                    .cloned()
                    .collect(),
            })
        }
    }
}

/// The steps in an interval of `found` seconds, if it is a whole number of them.
fn hold(found: f64, step: f64) -> Option<u64> {
    let steps = (found / step).round();
    let is_whole = (found - steps * step).abs() <= 1e-9 * found;
    (is_whole && (1.0..=MOST_STEPS).contains(&steps)).then_some(steps as u64)
}

/// The controls of a message in the scene's units.
fn loads(scene: &Scene, message: &ControlSequence) -> Result<Vec<Load>, ControlError> {
    let (forces, moments) = (message.force.len(), message.moment.len());
    if forces != moments {
        return Err(ControlError::Lengths { forces, moments });
    }
    let finite = |field, interval, vector: &Vector3| {
        let value = [vector.x, vector.y, vector.z];
        if value.iter().all(|component| component.is_finite()) {
            Ok(value.into())
        } else {
            Err(ControlError::NotFinite {
                field,
                interval,
                value,
            })
        }
    };
    let intervals = message.force.iter().zip(&message.moment).enumerate();
    intervals
        .map(|(interval, (force, moment))| {
            let load = Load {
                force: finite("force", interval, force)?,
                moment: finite("moment", interval, moment)?,
            };
            Ok(scene.units.load_from_si(&load))
        })
        .collect()
}
