use std::process::ExitCode;

use crate::ParameterError;
use crate::ros::{PublishError, RosError, TakeError};
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

impl From<ParameterError> for NodeError {
    fn from(error: ParameterError) -> Self {
        Self::input(error)
    }
}

impl From<RosError> for NodeError {
    fn from(error: RosError) -> Self {
        Self::runtime(error)
    }
}

impl From<PublishError> for NodeError {
    fn from(error: PublishError) -> Self {
        Self::runtime(error)
    }
}

impl From<TakeError> for NodeError {
    fn from(error: TakeError) -> Self {
        Self::runtime(error)
    }
}
