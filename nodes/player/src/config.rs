use std::collections::BTreeSet;
use std::path::PathBuf;

use lgvi_common::{Selection, publishes_clock, required_path};
use lgvi_middleware::node::NodeError;
use lgvi_middleware::{ParameterChange, ParameterSpec, Parameters};

use crate::range::Range;

/// The node's parameters, as they are when it is configured.
pub(crate) struct Config {
    pub(crate) bag: PathBuf,
    /// How often to publish `/clock` a recorded second at most, if at all.
    pub(crate) clock: Option<f64>,
    /// How many subscribers each topic must have before the replay begins.
    pub(crate) await_subscribers: usize,
    pub(crate) start_paused: bool,
    pub(crate) selection: Selection,
}

pub(crate) fn specifications() -> Vec<ParameterSpec> {
    let mut specifications = vec![
        ParameterSpec::new(
            "bag",
            String::new(),
            "directory of the bag, or one MCAP file (required)",
        ),
        ParameterSpec::new(
            "rate",
            1.0,
            "recorded seconds per second; 0: as fast as possible, without loss",
        )
        .range(0.0, f64::MAX)
        .change(ParameterChange::Anytime),
        ParameterSpec::new("loop", false, "repeat the bag until stopped")
            .change(ParameterChange::Anytime),
        ParameterSpec::new(
            "start_paused",
            false,
            "start paused, until ~/resume is called",
        ),
        ParameterSpec::new("clock", false, "publish the recorded times on /clock"),
        ParameterSpec::new(
            "clock_frequency",
            100.0,
            "highest rate of /clock in recorded time (Hz)",
        )
        .range(1e-3, 1e6),
        ParameterSpec::new(
            "await_subscribers",
            0_i64,
            "number of subscribers that every topic must have before the start",
        )
        .integer_range(0, 1000),
    ];
    specifications.extend(Range::specifications());
    let names = |name, description| ParameterSpec::new(name, Vec::<String>::new(), description);
    specifications.extend([
        names(
            "topics",
            "topics to play, by their names in the bag; empty: all, or those that match regex",
        ),
        names("exclude_topics", "topics not to play"),
    ]);
    specifications.extend(Selection::patterns(
        "also play topics whose names match",
        "do not play topics whose names match",
    ));
    specifications
}

impl Config {
    pub(crate) fn read(parameters: &Parameters) -> Result<Self, NodeError> {
        let await_subscribers: i64 = parameters.get("await_subscribers")?;
        let frequency = parameters.get("clock_frequency")?;
        let topics: Vec<String> = parameters.get("topics")?;
        let topics: BTreeSet<_> = topics.into_iter().collect();
        let exclude: Vec<String> = parameters.get("exclude_topics")?;
        Ok(Self {
            bag: required_path(parameters, "bag")?,
            clock: publishes_clock(parameters)?.then_some(frequency),
            await_subscribers: usize::try_from(await_subscribers).map_err(NodeError::input)?,
            start_paused: parameters.get("start_paused")?,
            selection: Selection::read(
                parameters,
                Some(topics).filter(|topics| !topics.is_empty()),
                exclude.into_iter().collect(),
            )?,
        })
    }
}

/// Recorded seconds a second; 0 means as fast as possible.
pub(crate) fn rate(parameters: &Parameters) -> Result<f64, NodeError> {
    Ok(parameters.get("rate")?)
}

/// Whether to begin anew at the end.
pub(crate) fn is_loop(parameters: &Parameters) -> Result<bool, NodeError> {
    Ok(parameters.get("loop")?)
}
