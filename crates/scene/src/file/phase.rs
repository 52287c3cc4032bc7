use serde::Deserialize;

use crate::compile::ConstraintFile;

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct PhaseFile {
    /// Name of the phase.
    pub name: String,
    /// How long it lasts: a number, or a range in which it is found; of the last phase the rest of the run by default.
    pub duration: Option<PhaseDurationFile>,
    /// Constraints that hold in this phase, beside those of the maneuver.
    #[serde(default)]
    pub constraints: Vec<ConstraintFile>,
    /// Commands that are off in this phase: thrusters or wheels by name, actuators by number from 0, or "force" and "moment".
    #[serde(default)]
    pub off: Vec<OffFile>,
}

#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected a duration, or a range { min = …, max = … }"
)]
pub(crate) enum PhaseDurationFile {
    Fixed(f64),
    Range(RangeFile),
}

#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct RangeFile {
    /// Shortest duration.
    pub min: f64,
    /// Longest duration.
    pub max: f64,
}

#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "expected a name, or a number from 0")]
pub(crate) enum OffFile {
    Name(String),
    Number(usize),
}
