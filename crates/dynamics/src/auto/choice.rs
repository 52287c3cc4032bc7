use std::fmt;

use crate::Method;

/// A method and its number of substeps, chosen for a run, with the reasons for the choice.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The method.
    pub method: Method,
    /// Steps of the method in each step of the run.
    pub substeps: u32,
    /// The error at the end of the run, as [`Accuracy`](crate::Accuracy) measures it: the error against the reference plus the
    /// reference's own error.
    pub error: f64,
    /// The basis of the error estimate.
    pub outlook: Outlook,
    /// For each method, the cheapest candidate that meets the tolerance, or else the most accurate one. The choice is
    /// the first.
    pub candidates: Vec<Candidate>,
    /// Gravity evaluations that the search took.
    pub evaluations: u64,
}

/// A method that was compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The method.
    pub method: Method,
    /// Steps of the method in each step of the run.
    pub substeps: u32,
    /// The error at the end of the run, or infinity if the flight was abandoned.
    pub error: f64,
    /// Predicted cost of the run, in approximate nanoseconds.
    pub cost: f64,
}

/// The knowledge of the end of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outlook {
    /// The whole run was rehearsed, and the tolerance is met.
    Met,
    /// The run is too expensive to rehearse in full. The tolerance is met if errors grow with the square of time after
    /// the rehearsed part.
    Extrapolated {
        /// Time up to which the run was rehearsed.
        horizon: f64,
    },
    /// The motion is so sensitive that no method in double precision determines the state at the end. The choice meets
    /// the tolerance up to a certain time and continues with steps of the same accuracy.
    Chaotic {
        /// Time up to which the tolerance is met.
        known: f64,
    },
}

impl Choice {
    /// A warning if the tolerance is not met or not known to be met, else `None`.
    pub fn warning(&self) -> Option<String> {
        let Self { outlook, error, .. } = self;
        (*outlook != Outlook::Met).then(|| format!("{outlook} (expected error {error:.1e})"))
    }
}

impl fmt::Display for Outlook {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Met => write!(f, "the tolerance is met: the whole run was rehearsed"),
            Self::Extrapolated { horizon } => write!(
                f,
                "the run was rehearsed up to t = {horizon:.4} only: the tolerance is met if errors grow no faster than the square of time after that"
            ),
            Self::Chaotic { known } => write!(
                f,
                "the motion is chaotic: the tolerance is met up to about t = {known:.4}, and nothing is known of the end"
            ),
        }
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}, substeps: {}, error {:.1e}; {}",
            self.method, self.substeps, self.error, self.outlook
        )?;
        for Candidate {
            method,
            substeps,
            error,
            cost,
        } in &self.candidates
        {
            let seconds = 1e-9 * cost;
            let method = method.to_string();
            writeln!(
                f,
                "  {method:<40} {substeps:>8} substeps  error {error:>8.1e}  {seconds:>9.2e} s"
            )?;
        }
        write!(f, "{} evaluations of gravity", self.evaluations)
    }
}
