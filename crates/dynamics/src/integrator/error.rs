use thiserror::Error;

use crate::gravity::CloseApproach;
use crate::rotation::Unsolvable;

/// Why a step could not be made. Bodies count from 0.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum StepError {
    /// There is not one control a body.
    #[error("there are {found} controls for {expected} bodies")]
    Controls {
        /// Number of bodies.
        expected: usize,
        /// Number of controls.
        found: usize,
    },
    /// The body turns too far in one step.
    #[error("body {body}: {source}")]
    Unsolvable {
        /// Which body.
        body: usize,
        /// By how much.
        source: Unsolvable,
    },
    /// The step would end in NaN or infinity, as where two points of mass meet.
    #[error("body {body}: the state after the step is not finite")]
    NotFinite {
        /// Which body.
        body: usize,
    },
    /// The step would end inside a body.
    #[error(transparent)]
    CloseApproach(#[from] CloseApproach),
    /// The step is too long for how fast the loads change.
    #[error(
        "body {body}: the step does not resolve the motion, its loads change by {excess:.1} times what they may"
    )]
    Unresolved {
        /// Which body.
        body: usize,
        /// Change over the step in multiples of the limits of [`Subdivision`](super::Subdivision), > 1.
        excess: f64,
    },
    /// The body turns further in one step than the method's chart of attitudes reaches.
    #[error("body {body} turns by {turn:.3} rad in one step, expected less than π")]
    TurnsTooFar {
        /// Which body.
        body: usize,
        /// The angle of its turn.
        turn: f64,
    },
    /// The iteration for the implicit equations of a step did not converge.
    #[error(
        "the implicit equations of the step were not solved: residual {residual:.1e} after {iterations} iterations, expected \
         at most {tolerance:.1e}"
    )]
    NotConverged {
        /// Iterations made.
        iterations: u32,
        /// Residual left, relative.
        residual: f64,
        /// What was asked.
        tolerance: f64,
    },
    /// The error control asks for steps too small to advance time.
    #[error("the error control needs steps of {step:.1e}, at least {least:.1e} is possible")]
    StepSizeUnderflow {
        /// The step that the error control asks for.
        step: f64,
        /// The least step that changes time.
        least: f64,
    },
    /// The error control needs too many internal steps.
    #[error("the error control needs more than {limit} steps for one output")]
    TooManySteps {
        /// How many are possible.
        limit: u32,
    },
}

impl StepError {
    /// That a body cannot turn as it would; that its momentum is not a number where that is why.
    pub(crate) fn of_rotation(body: usize, source: Unsolvable) -> Self {
        if source.turn.is_nan() {
            Self::NotFinite { body }
        } else {
            Self::Unsolvable { body, source }
        }
    }

    /// The body that the error is about; the first of two.
    pub fn body(&self) -> Option<usize> {
        match self {
            Self::Unsolvable { body, .. }
            | Self::TurnsTooFar { body, .. }
            | Self::NotFinite { body }
            | Self::CloseApproach(CloseApproach { body, .. })
            | Self::Unresolved { body, .. } => Some(*body),
            Self::Controls { .. }
            | Self::NotConverged { .. }
            | Self::TooManySteps { .. }
            | Self::StepSizeUnderflow { .. } => None,
        }
    }
}

/// Why a method cannot integrate a system. Bodies count from 0.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum MethodError {
    /// The method knows no bodies of this mobility.
    #[error("{method} cannot integrate body {body}: {expected}")]
    Body {
        /// Name of the method.
        method: &'static str,
        /// Which body.
        body: usize,
        /// What the method can.
        expected: &'static str,
    },
    /// The method knows no gravity.
    #[error("{method} integrates free bodies only, but gravity acts here")]
    Gravity {
        /// Name of the method.
        method: &'static str,
    },
    /// There is not one state a body.
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
        /// Which body.
        body: usize,
    },
    /// A body's attitude is no rotation.
    #[error(
        "body {body}: its attitude is not a rotation, |RᵀR − I| is {orthogonality_error:.1e} and det R {determinant:.3}, \
         expected less than 0.1 and 1"
    )]
    Attitude {
        /// Which body.
        body: usize,
        /// Frobenius norm of `RᵀR − I`.
        orthogonality_error: f64,
        /// `det R`.
        determinant: f64,
    },
    /// A number is so great or small that products of it leave the range of double precision.
    #[error("{}{quantity} is {value:e}, expected {low:e} to {high:e}", of(*.body))]
    Range {
        /// Which body; none where it is none's.
        body: Option<usize>,
        /// What.
        quantity: &'static str,
        /// How much.
        value: f64,
        /// The least that can be worked with.
        low: f64,
        /// The greatest.
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
        /// What would be right.
        expected: &'static str,
    },
}

/// What a message begins with.
fn of(body: Option<usize>) -> String {
    body.map_or_else(String::new, |body| format!("body {body}: "))
}
