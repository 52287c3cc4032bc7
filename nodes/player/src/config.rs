use std::path::PathBuf;

use lgvi_middleware::{ParameterChange, ParameterSpec, Parameters};
use lgvi_node::{NodeError, publishes_clock, required_path};

/// The node's parameters, as they are when it is configured.
pub(crate) struct Config {
    pub(crate) bag: PathBuf,
    /// Whether to publish `/clock` at the recorded times.
    pub(crate) clock: bool,
    /// How many subscribers each topic must have before the replay begins.
    pub(crate) await_subscribers: usize,
}

pub(crate) fn specifications() -> Vec<ParameterSpec> {
    vec![
        ParameterSpec::new(
            "bag",
            String::new(),
            "the bag's directory, or its MCAP file (required)",
        ),
        ParameterSpec::new(
            "rate",
            1.0,
            "recorded seconds a second; 0: as fast as possible, without loss",
        )
        .range(0.0, f64::MAX)
        .change(ParameterChange::Anytime),
        ParameterSpec::new(
            "clock",
            false,
            "whether to publish /clock at the recorded times",
        ),
        ParameterSpec::new(
            "await_subscribers",
            0_i64,
            "hold until every topic has so many subscribers",
        )
        .integer_range(0, 1000),
    ]
}

impl Config {
    pub(crate) fn read(parameters: &Parameters) -> Result<Self, NodeError> {
        let await_subscribers: i64 = parameters
            .get("await_subscribers")
            .map_err(NodeError::input)?;
        Ok(Self {
            bag: required_path(parameters, "bag")?,
            clock: publishes_clock(parameters)?,
            await_subscribers: usize::try_from(await_subscribers).map_err(NodeError::input)?,
        })
    }
}

/// Recorded seconds a second; 0 means as fast as possible.
pub(crate) fn rate(parameters: &Parameters) -> Result<f64, NodeError> {
    parameters.get("rate").map_err(NodeError::input)
}
