use thiserror::Error;

use crate::PlanError;

/// The reason why bodies are not planned together. Bodies are indices of transfers, from 0.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum FormationError {
    /// There are fewer than two transfers.
    #[error("there are {0} transfers, expected two or more")]
    Few(usize),
    /// The separation is not a positive number.
    #[error("the separation is {0}, expected a finite number > 0")]
    Separation(f64),
    /// The transfers do not have the same steps.
    #[error("body {body} has {intervals} steps of {h}, expected those of body 0")]
    Steps {
        /// The body.
        body: usize,
        /// Its number of steps.
        intervals: usize,
        /// Their size.
        h: f64,
    },
    /// The plans to start from are not those of the transfers.
    #[error(
        "the plans to start from have {steps:?} steps, expected {intervals} of each of {transfers}"
    )]
    Warm {
        /// Their numbers of steps.
        steps: Vec<usize>,
        /// The number of transfers.
        transfers: usize,
        /// The number of steps of each.
        intervals: usize,
    },
    /// A transfer has what is not planned together with others.
    #[error("body {body} has {what}, expected {expected}: the bodies are planned together")]
    Unsupported {
        /// The body.
        body: usize,
        /// What it has.
        what: &'static str,
        /// What is planned.
        expected: &'static str,
    },
    /// Two bodies start or end nearer to each other than the separation.
    #[error("bodies {} and {} {at} {distance:.6e} from each other, expected at least the separation {separation:.6e}", bodies[0], bodies[1])]
    Near {
        /// The bodies.
        bodies: [usize; 2],
        /// Where: "start" or "end".
        at: &'static str,
        /// Their distance.
        distance: f64,
        /// The separation.
        separation: f64,
    },
    /// No plan of a body was found that keeps away from another one.
    #[error("no plan keeps bodies {} and {} apart: {source}", bodies[0], bodies[1])]
    Apart {
        /// The bodies; the second one gives way.
        bodies: [usize; 2],
        /// Why, where the constraint is that of the separation and violations are in parts of it.
        source: Box<PlanError>,
    },
    /// No plan of a body was found.
    #[error("body {body}: {source}")]
    Body {
        /// The body.
        body: usize,
        /// Why.
        source: Box<PlanError>,
    },
    /// The prices of the separation did not settle.
    #[error(
        "the prices of the separation did not settle in {rounds} rounds: they change by {change:.1e} of themselves, expected at most \
         {tolerance:.0e}"
    )]
    Unsettled {
        /// The number of rounds.
        rounds: u32,
        /// The change of the prices, relative to them.
        change: f64,
        /// Its tolerance.
        tolerance: f64,
    },
    /// The caller asked to stop.
    #[error("stopped")]
    Stopped,
}
