//! Shared by lgvi's nodes: scene files, events and warnings for the process that started a node, and the one conversion
//! between the dynamics' states and loads and the samples that leave a process.

mod convert;
mod event;
mod frame_prefix;
mod parameters;
mod scene_file;
mod selection;
mod warning;

pub use convert::{
    Correction, Feedback, GAIN, Gain, Limits, body_sample, body_state, control_sequence, header,
    pose,
};
pub use event::{CommandTimeouts, Docked, Event, FlightReport, Miss, PlanReport};
pub use frame_prefix::FramePrefix;
pub use parameters::{publishes_clock, required_path};
pub use scene_file::{load_scene, parse_scene, read_scene, set_key};
pub use selection::{Choice, Selection};
pub use warning::{Warning, WarningCode};
