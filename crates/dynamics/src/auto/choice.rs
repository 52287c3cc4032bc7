use std::fmt;

use crate::Method;

/// A method and its substeps, chosen for a run, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The method.
    pub method: Method,
    /// Steps of the method in each step of the run.
    pub substeps: u32,
    /// What is to be expected of the accuracy.
    pub outlook: Outlook,
    /// Methods that were compared, the cheapest first.
    pub candidates: Vec<Candidate>,
    /// Duration of the pilot flight, 0 where none was needed.
    pub horizon: f64,
    /// Evaluations of gravity that pilot flights took.
    pub evaluations: u64,
}

impl Choice {
    /// For bodies on which nothing acts.
    pub(super) fn closed_form(cost: f64) -> Self {
        let method = Method::ClosedForm;
        let only = Candidate {
            method,
            substeps: 1,
            error: f64::EPSILON,
            cost,
            measured: false,
        };
        Self {
            method,
            substeps: 1,
            outlook: Outlook::Met,
            candidates: vec![only],
            horizon: 0.0,
            evaluations: 0,
        }
    }
}

/// A method that was compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The method.
    pub method: Method,
    /// Steps of the method in each step of the run.
    pub substeps: u32,
    /// Predicted error at the end of the run, as [`Accuracy`](super::Accuracy) measures it.
    pub error: f64,
    /// Predicted cost of the run, about nanoseconds.
    pub cost: f64,
    /// Whether it was flown in the last pilot; others were seen to cost more before.
    pub measured: bool,
}

/// What is to be expected of the accuracy at the end of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outlook {
    /// The tolerance is met.
    Met,
    /// Rounding alone makes about this error, which is too near the tolerance or above. The choice reaches three times
    /// that.
    Limited {
        /// Predicted error.
        floor: f64,
    },
    /// The motion is so sensitive that no method in double precision knows the state at the end. The choice meets the
    /// tolerance up to a time, and makes steps of the same accuracy after that.
    Chaotic {
        /// Time up to which the tolerance is met.
        known: f64,
    },
}

impl fmt::Display for Outlook {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Met => write!(f, "the tolerance is met if errors grow on as in the pilot"),
            Self::Limited { floor } => {
                write!(f, "rounding limits the accuracy to about {floor:.1e}")
            }
            Self::Chaotic { known } => {
                write!(
                    f,
                    "chaotic: the tolerance is met up to about t = {known:.3}"
                )
            }
        }
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}, substeps: {}; {}",
            self.method, self.substeps, self.outlook
        )?;
        for Candidate {
            method,
            substeps,
            error,
            cost,
            measured,
        } in &self.candidates
        {
            let seconds = 1e-9 * cost;
            let how = if *measured {
                "measured"
            } else {
                "extrapolated"
            };
            let method = method.to_string();
            writeln!(
                f,
                "  {method:<32} {substeps:>8} substeps  error {error:>8.1e}  {seconds:>9.2e} s  {how}"
            )?;
        }
        write!(
            f,
            "pilot: {} evaluations of gravity over a time of {}",
            self.evaluations, self.horizon
        )
    }
}
