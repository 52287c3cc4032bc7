//! What the node binaries share: how they start and end, what they tell the process that started them, and the one
//! conversion between the dynamics' states and loads and the samples that leave a process.

mod command_line;
mod convert;
mod error;
mod event;
mod file_lock;
mod file_size;
mod frame_prefix;
mod managed;
mod namesakes;
mod node;
mod parameters;
mod scene_file;
mod warning;

pub use command_line::{complain, with_arguments};
pub use convert::{
    Correction, FeedbackSequence, Gain, Limits, body_sample, body_state, control_interval,
    correction, feedback_interval, feedback_sequence, header, load, pose,
};
pub use error::NodeError;
pub use event::{Event, FlightReport, Miss, PlanReport};
pub use file_lock::{FileLock, LockError};
pub use file_size::let_long_files_fail;
pub use frame_prefix::FramePrefix;
pub use managed::{Managed, Stopped, main};
pub use node::Node;
pub use parameters::{publishes_clock, required_path};
pub use scene_file::load_scene;
pub use warning::{Warning, WarningCode};
