//! Why an integrator was chosen.

use std::fmt::{Display, Formatter, Result};

use lgvi_dynamics::auto::Choice;
use lgvi_scene::Scene;
use serde::Serialize;

/// What was compared, and what is to be expected.
#[derive(Debug, Serialize)]
pub(super) struct Chosen {
    /// Whether the tolerance is met.
    pub(super) outlook: String,
    /// The cheapest first, which is the one chosen.
    pub(super) candidates: Vec<Candidate>,
    /// Duration of the pilot flight (s).
    pub(super) pilot: f64,
    /// Evaluations of gravity in pilot flights.
    pub(super) evaluations: u64,
}

/// A method that was compared.
#[derive(Debug, Serialize)]
pub(super) struct Candidate {
    pub(super) method: String,
    pub(super) substeps: u32,
    /// Predicted at the end of the run: positions relative to the size of the scene, attitudes in rad.
    pub(super) error: f64,
    /// Predicted, of the run (s).
    pub(super) cost: f64,
    /// In a pilot flight, near that many substeps.
    pub(super) measured: bool,
}

impl Chosen {
    pub(super) fn of(scene: &Scene, choice: &Choice) -> Self {
        let candidates = choice.candidates.iter().map(|candidate| Candidate {
            method: candidate.method.to_string(),
            substeps: candidate.substeps,
            error: candidate.error,
            cost: 1e-9 * candidate.cost,
            measured: candidate.measured,
        });
        Self {
            outlook: choice.outlook.to_string(),
            candidates: candidates.collect(),
            pilot: choice.horizon * scene.units.time,
            evaluations: choice.evaluations,
        }
    }
}

impl Display for Chosen {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "\n  outlook     {}", self.outlook)?;
        write!(
            f,
            "\n  pilot       {} evaluations of gravity over {:.6e} s",
            self.evaluations, self.pilot
        )?;
        write!(f, "\n  candidates  (predicted for the run)")?;
        for Candidate {
            method,
            substeps,
            error,
            cost,
            measured,
        } in &self.candidates
        {
            let how = if *measured {
                "measured"
            } else {
                "extrapolated"
            };
            write!(
                f,
                "\n    {method:<47} {substeps:>8} substeps  error {error:>8.1e}  {cost:>9.2e} s  {how}"
            )?;
        }
        Ok(())
    }
}
