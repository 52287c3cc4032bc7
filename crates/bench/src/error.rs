use std::path::{Path, PathBuf};

use lgvi_dynamics::auto::ChoiceError;
use lgvi_dynamics::{MethodError, StepError};
use lgvi_scene::SceneError;
use lgvi_truth::TruthError;
use lgvi_truth::maneuvers::ManeuverError;
use serde::Serialize;
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
    #[error("{0}")]
    Nodes(String),
    #[error("writing bags: {0}")]
    Bag(String),
    #[error("failed: {}", .0.join(", "))]
    Failed(Vec<String>),
    #[error("not as it should be: {0}")]
    Stress(String),
    #[error("no plan: {0}")]
    Plan(String),
    #[error("{0}")]
    Picture(String),
    #[error(transparent)]
    Maneuver(#[from] ManeuverError),
    #[error("{path}: {source}")]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("unknown case {name:?}, expected one of {known:?}")]
    Case {
        name: String,
        known: Vec<&'static str>,
    },
}

/// Writes figures to the file at `path`, whose directory is made.
pub(crate) fn write_json(path: &Path, figures: &impl Serialize) -> Result<(), BenchError> {
    let text = serde_json::to_string_pretty(figures).map_err(|error| BenchError::Write {
        path: path.into(),
        source: error.into(),
    })?;
    write_text(path, &text)?;
    println!("{}", path.display());
    Ok(())
}

/// Writes the file at `path`, whose directory is made.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<(), BenchError> {
    let refuse = |source| BenchError::Write {
        path: path.into(),
        source,
    };
    if let Some(directory) = path.parent() {
        std::fs::create_dir_all(directory).map_err(refuse)?;
    }
    std::fs::write(path, text).map_err(refuse)
}
