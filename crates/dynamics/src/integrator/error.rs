use std::fmt;

use thiserror::Error;

use super::Method;

use crate::gravity::CloseApproach;
use crate::rotation::Unsolvable;

/// Reasons why a step could not be made. Bodies are counted from 0.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum StepError {
    /// The number of controls differs from the number of bodies.
    Controls {
        /// Number of bodies.
        expected: usize,
        /// Number of controls.
        found: usize,
    },
    /// The body rotates too far in one step.
    Unsolvable {
        /// Index of the body.
        body: usize,
        /// Details of the rotation.
        source: Unsolvable,
    },
    /// The step would end in NaN or infinity, for example because two point masses coincide.
    NotFinite {
        /// Index of the body.
        body: usize,
    },
    /// The step would end with a body inside another body or a source.
    CloseApproach(#[from] CloseApproach),
    /// The step is too long to resolve the change of the loads.
    Unresolved {
        /// Index of the body.
        body: usize,
        /// Change over the step in multiples of the limits of [`Subdivision`](super::Subdivision), > 1.
        excess: f64,
    },
    /// The body rotates further in one step than the method's attitude chart covers.
    TurnsTooFar {
        /// Index of the body.
        body: usize,
        /// Rotation angle.
        turn: f64,
    },
    /// The iteration for the implicit equations of a step did not converge.
    NotConverged {
        /// Iterations made.
        iterations: u32,
        /// Remaining relative residual.
        residual: f64,
        /// Required tolerance.
        tolerance: f64,
    },
    /// Two bodies dock that do not form a rigid body within the range of numbers.
    Docking {
        /// Index of the body.
        body: usize,
        /// Index of the other body.
        other: usize,
    },
    /// The error control requires steps too small to advance time.
    StepSizeUnderflow {
        /// Step requested by the error control.
        step: f64,
        /// Smallest step that changes the time.
        least: f64,
    },
    /// The error control needs too many internal steps.
    TooManySteps {
        /// Largest number allowed.
        limit: u32,
    },
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.in_words(|body| format!("body {body}")))
    }
}

impl StepError {
    /// Returns the error as a message that calls the body of an index by its `name`.
    pub fn in_words(&self, name: impl Fn(usize) -> String) -> String {
        match *self {
            Self::Controls { expected, found } => {
                format!("there are {found} controls for {expected} bodies")
            }
            Self::Unsolvable { body, source } => format!("{}: {source}", name(body)),
            Self::NotFinite { body } => {
                format!("{}: the state after the step is not finite", name(body))
            }
            Self::CloseApproach(approach) => approach.in_words(name),
            Self::Unresolved { body, excess } => format!(
                "{}: the step does not resolve the motion, its loads change by {excess:.1} times what they may",
                name(body)
            ),
            Self::TurnsTooFar { body, turn } => format!(
                "{} turns by {turn:.3} rad in one step, expected less than π",
                name(body)
            ),
            Self::NotConverged {
                iterations,
                residual,
                tolerance,
            } => format!(
                "the implicit equations of the step were not solved: residual {residual:.1e} after {iterations} iterations, \
                 expected at most {tolerance:.1e}"
            ),
            Self::Docking { body, other } => format!(
                "{} and {} dock, but do not form a valid rigid body",
                name(body),
                name(other)
            ),
            Self::StepSizeUnderflow { step, least } => format!(
                "the error control needs steps of {step:.1e}, at least {least:.1e} is possible"
            ),
            Self::TooManySteps { limit } => {
                format!("the error control needs more than {limit} steps for one output")
            }
        }
    }

    /// The error of a body whose rotation could not be solved, or [`Self::NotFinite`] if its momentum is not a number.
    pub(crate) fn of_rotation(body: usize, source: Unsolvable) -> Self {
        if source.turn.is_nan() {
            Self::NotFinite { body }
        } else {
            Self::Unsolvable { body, source }
        }
    }

    /// The error of a simulation of joined bodies with the indices of their parts, which close approaches have already.
    pub(crate) fn of_parts(mut self, index: impl Fn(usize) -> usize) -> Self {
        match &mut self {
            Self::Unsolvable { body, .. }
            | Self::TurnsTooFar { body, .. }
            | Self::NotFinite { body }
            | Self::Unresolved { body, .. } => *body = index(*body),
            Self::CloseApproach(_)
            | Self::Docking { .. }
            | Self::Controls { .. }
            | Self::NotConverged { .. }
            | Self::TooManySteps { .. }
            | Self::StepSizeUnderflow { .. } => {}
        }
        self
    }

    /// The body that the error refers to. For a pair, the first body.
    pub fn body(&self) -> Option<usize> {
        match self {
            Self::Unsolvable { body, .. }
            | Self::TurnsTooFar { body, .. }
            | Self::NotFinite { body }
            | Self::CloseApproach(CloseApproach { body, .. })
            | Self::Docking { body, .. }
            | Self::Unresolved { body, .. } => Some(*body),
            Self::Controls { .. }
            | Self::NotConverged { .. }
            | Self::TooManySteps { .. }
            | Self::StepSizeUnderflow { .. } => None,
        }
    }
}

/// Reasons why a method cannot integrate a system. Bodies are counted from 0.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MethodError {
    /// The method does not support bodies of this mobility.
    #[error("{method} cannot integrate body {body}: {expected}")]
    Body {
        /// Name of the method.
        method: &'static str,
        /// Index of the body.
        body: usize,
        /// Bodies that the method supports.
        expected: &'static str,
    },
    /// The method does not support actuators.
    #[error(
        "{method} cannot integrate body {body}, which has reaction wheels or thrusters; use LGVI, a composition, Nyström, or \
         Dormand–Prince"
    )]
    Actuators {
        /// Name of the method.
        method: Method,
        /// Index of the body.
        body: usize,
    },
    /// The method does not support drag.
    #[error(
        "{method} cannot integrate body {body}, which has drag; use LGVI, a composition, or Dormand–Prince"
    )]
    Drag {
        /// Name of the method.
        method: Method,
        /// Index of the body.
        body: usize,
    },
    /// The method does not support gravity.
    #[error("{method} integrates free bodies only, but gravity acts here")]
    Gravity {
        /// Name of the method.
        method: &'static str,
    },
    /// The method does not support a gravity model.
    #[error(
        "{method} supports points of mass, multipoles of second order, attractors of these kinds, and uniform fields, but \
         another gravity acts here, or that of bodies that dock; use another method such as Dormand–Prince"
    )]
    Model {
        /// Name of the method.
        method: &'static str,
    },
    /// No attraction has a center.
    #[error(
        "{method} needs a fixed source with a center, or two free bodies that attract each other; use another method such as \
         the Nyström splitting"
    )]
    Center {
        /// Name of the method.
        method: &'static str,
    },
    /// The motion is not close to Kepler's.
    #[error(
        "{method} needs motion close to Kepler's, but the other forces on body {body} are {ratio:.2e} times the attraction \
         of its center, expected at most {limit}; use another method such as the Nyström splitting"
    )]
    Perturbation {
        /// Name of the method.
        method: &'static str,
        /// Index of the body.
        body: usize,
        /// Their ratio at the start.
        ratio: f64,
        /// Greatest supported ratio.
        limit: f64,
    },
    /// The ports of a docking are not on two different free bodies, or a body has actuators.
    #[error(
        "docking {docking}: its ports are on two different free bodies, in a system without reaction wheels and thrusters, in one atmosphere: \
         not so body {body}"
    )]
    Docking {
        /// Index of the docking, from 0.
        docking: usize,
        /// Index of the body.
        body: usize,
    },
    /// The number of states differs from the number of bodies.
    #[error("there are {found} states for {expected} bodies")]
    StateCount {
        /// Number of bodies.
        expected: usize,
        /// Number of states.
        found: usize,
    },
    /// A body's state is NaN or infinite.
    #[error("body {body}: its state is not finite")]
    State {
        /// Index of the body.
        body: usize,
    },
    /// A body's attitude is not a rotation.
    #[error(
        "body {body}: its attitude is not a rotation, |RᵀR − I| is {orthogonality_error:.1e} and det R {determinant:.3}, \
         expected less than 0.1 and 1"
    )]
    Attitude {
        /// Index of the body.
        body: usize,
        /// Frobenius norm of `RᵀR − I`.
        orthogonality_error: f64,
        /// `det R`.
        determinant: f64,
    },
    /// A value is so large or small that its products overflow or underflow in double precision.
    #[error("{}{quantity} is {value:e}, expected {low:e} to {high:e}", of(*.body))]
    Range {
        /// Index of the body, or `None` if the value does not belong to a body.
        body: Option<usize>,
        /// Name of the quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Smallest supported value.
        low: f64,
        /// Largest supported value.
        high: f64,
    },
    /// A parameter of the method is out of range.
    #[error("{method}: {parameter} is {value}, expected {expected}")]
    Parameter {
        /// Name of the method.
        method: &'static str,
        /// Name of the parameter.
        parameter: &'static str,
        /// Its value.
        value: f64,
        /// Description of valid values.
        expected: &'static str,
    },
}

/// The beginning of a message.
fn of(body: Option<usize>) -> String {
    body.map_or_else(String::new, |body| format!("body {body}: "))
}
