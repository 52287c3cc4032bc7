use lgvi_dynamics::{MethodError, StepError};
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
    #[error("{0}")]
    Peer(String),
    #[error("{0}")]
    Picture(String),
    #[error("unknown case {name:?}, expected one of {known:?}")]
    Case {
        name: String,
        known: Vec<&'static str>,
    },
}
