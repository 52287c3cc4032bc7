//! Why an integrator was chosen.

use std::fmt::{Display, Formatter, Result};

use lgvi_dynamics::auto::Choice;
use serde::Serialize;

/// What was compared, and what is to be expected.
#[derive(Debug, Serialize)]
pub(super) struct Chosen {
    /// What is known of the end of the run.
    pub(super) outlook: String,
    /// Error at the end of the run: positions relative to the size of the scene, attitudes in rad.
    pub(super) error: f64,
    /// Of each method the last that was rehearsed.
    pub(super) candidates: Vec<Candidate>,
    /// Evaluations of gravity in all rehearsals.
    pub(super) evaluations: u64,
}

/// A method that was compared.
#[derive(Debug, Serialize)]
pub(super) struct Candidate {
    pub(super) method: String,
    pub(super) substeps: u32,
    /// As above; none where the rehearsal was given up.
    pub(super) error: Option<f64>,
    /// Predicted, of the run (s).
    pub(super) cost: f64,
}

impl Chosen {
    pub(super) fn of(choice: &Choice) -> Self {
        let candidates = choice.candidates.iter().map(|candidate| Candidate {
            method: candidate.method.to_string(),
            substeps: candidate.substeps,
            error: Some(candidate.error).filter(|error| error.is_finite()),
            cost: 1e-9 * candidate.cost,
        });
        Self {
            outlook: choice.outlook.to_string(),
            error: choice.error,
            candidates: candidates.collect(),
            evaluations: choice.evaluations,
        }
    }
}

impl Display for Chosen {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "\n  outlook     {}", self.outlook)?;
        write!(f, "\n  error       {:.1e} at the end", self.error)?;
        write!(
            f,
            "\n  rehearsals  {} evaluations of gravity",
            self.evaluations
        )?;
        write!(f, "\n  candidates  (cost as predicted for the run)")?;
        for Candidate {
            method,
            substeps,
            error,
            cost,
        } in &self.candidates
        {
            let error = error.map_or("too large".into(), |error| format!("{error:.1e}"));
            write!(
                f,
                "\n    {method:<47} {substeps:>8} substeps  error {error:>9}  {cost:>9.2e} s"
            )?;
        }
        Ok(())
    }
}
