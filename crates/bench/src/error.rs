use std::path::PathBuf;

use lgvi_dynamics::auto::ChoiceError;
use lgvi_dynamics::{MethodError, StepError};
use lgvi_scene::SceneError;
use lgvi_truth::TruthError;
use thiserror::Error;

/// Why a benchmark cannot be run.
#[derive(Debug, Error)]
pub(crate) enum BenchError {
    #[error(transparent)]
    Truth(#[from] TruthError),
    #[error(transparent)]
    Method(#[from] MethodError),
    #[error(transparent)]
    Step(#[from] StepError),
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    #[error("{path}: {source}")]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("scene {name}: {source}")]
    Scene { name: String, source: SceneError },
    #[error("{0}")]
    Body(String),
    #[error("nothing called {name:?}, expected one of {known:?}")]
    Run { name: String, known: Vec<String> },
    #[error("{0}")]
    Peer(String),
    #[error("no plan: {0}")]
    Plan(String),
    #[error("{0}")]
    Report(String),
    #[error("{0}")]
    Picture(String),
    #[error("unknown case {name:?}, expected one of {known:?}")]
    Case {
        name: String,
        known: Vec<&'static str>,
    },
}
