//! Shared by lgvi's nodes: scene files, events and warnings for the process that started a node, and the one conversion
//! between the dynamics' states and loads and the samples that leave a process.

mod convert;
#[cfg(feature = "node")]
mod event;
#[cfg(feature = "node")]
mod frame_prefix;
#[cfg(feature = "node")]
mod parameters;
mod scene_file;
#[cfg(feature = "node")]
mod selection;
mod warning;

pub use convert::{
    Correction, DEVIATIONS, Feedback, GAIN, Gain, Limits, actuator_sequence, body_sample,
    body_state, control_sequence, gain_from_si, gain_si, header, pose, row_units,
};
#[cfg(feature = "node")]
pub use event::{
    Arrival, CommandTimeouts, Docked, Event, FlightReport, Miss, PhaseReport, PhasesReport,
    PlanReport, ReplanReport, SoftReport,
};
#[cfg(feature = "node")]
pub use frame_prefix::FramePrefix;
#[cfg(feature = "node")]
pub use parameters::{publishes_clock, required_path};
pub use scene_file::{
    KeyError, Reason as SceneFileReason, SceneFileError, load_scene, parse_scene, read_scene,
    set_key,
};
#[cfg(feature = "node")]
pub use selection::{Choice, Selection};
pub use warning::{Warning, WarningCode};
