use std::path::PathBuf;

use lgvi_middleware::Parameters;
use lgvi_node::NodeError;

/// The node's parameters.
pub(crate) struct Config {
    /// `bag`: the bag's directory or MCAP file.
    pub(crate) bag: PathBuf,
    /// `rate`: recorded seconds a second; 0 means as fast as possible, without loss.
    pub(crate) rate: f64,
    /// `clock`: whether to publish `/clock` at the recorded times.
    pub(crate) clock: bool,
    /// `await_subscribers`: how many subscribers each topic must have before the replay begins.
    pub(crate) await_subscribers: usize,
}

impl Config {
    pub(crate) fn take(mut parameters: Parameters) -> Result<Self, NodeError> {
        let bag: Option<PathBuf> = parameters.take("bag").map_err(NodeError::input)?;
        let rate = parameters
            .take("rate")
            .map_err(NodeError::input)?
            .unwrap_or(1.0);
        let clock = parameters
            .take("clock")
            .map_err(NodeError::input)?
            .unwrap_or(false);
        let await_subscribers = parameters
            .take("await_subscribers")
            .map_err(NodeError::input)?
            .unwrap_or(0);
        parameters.finish().map_err(NodeError::input)?;
        let bag = bag.ok_or_else(|| {
            NodeError::Input("parameter \"bag\" is missing, expected a path".into())
        })?;
        if !(rate >= 0.0 && f64::is_finite(rate)) {
            let message = format!("parameter \"rate\" is {rate}, expected a finite number ≥ 0");
            return Err(NodeError::Input(message));
        }
        Ok(Self {
            bag,
            rate,
            clock,
            await_subscribers,
        })
    }

    /// Whether nothing may be lost because nothing has to be on time.
    pub(crate) fn lossless(&self) -> bool {
        self.rate == 0.0
    }
}
