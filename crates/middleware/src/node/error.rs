use std::process::ExitCode;

use crate::ros::{PublishError, RosError, TakeError};
use crate::shm::ShmError;
use crate::{NameError, ParameterError};
use thiserror::Error;

/// Why a node ends before its work is done.
#[derive(Debug, Error)]
pub enum NodeError {
    /// What it was given cannot be used: exit code 2.
    #[error("{0}")]
    Input(String),
    /// What it was doing failed: exit code 1.
    #[error("{0}")]
    Runtime(String),
    /// It was told to end meanwhile: exit code 0.
    #[error("stopped before it was ready")]
    Interrupted,
}

impl NodeError {
    /// Something wrong with what the node was given.
    pub fn input(error: impl ToString) -> Self {
        Self::Input(error.to_string())
    }

    /// Something that failed on the way.
    pub fn runtime(error: impl ToString) -> Self {
        Self::Runtime(error.to_string())
    }

    /// The code that the process exits with.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(self.code())
    }

    /// The same as a number.
    pub fn code(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Runtime(_) => 1,
            Self::Interrupted => 0,
        }
    }
}

/// Which errors of this crate are about what the node was given, and which happen on the way.
macro_rules! from {
    ($($error:ty => $kind:ident),* $(,)?) => {$(
        impl From<$error> for NodeError {
            fn from(error: $error) -> Self {
                Self::$kind(error)
            }
        }
    )*};
}
from!(
    NameError => input,
    ParameterError => input,
    RosError => runtime,
    PublishError => runtime,
    TakeError => runtime,
);

impl From<ShmError> for NodeError {
    fn from(error: ShmError) -> Self {
        match error {
            ShmError::Interrupted { .. } => Self::Interrupted,
            error => Self::runtime(error),
        }
    }
}
