//! A managed ROS 2 node: implement [`Managed`], call [`main`].
//!
//! The node has parameters, a lifecycle, diagnostics, `/rosout`, the clock of `use_sim_time`, and the command line of
//! ROS 2; it ends in order on SIGINT and SIGTERM. The example `own_node` shows all of it.

mod command_line;
mod error;
mod event;
mod file_lock;
mod file_size;
mod help;
mod managed;
mod namesakes;
mod start;

pub use command_line::{complain, with_arguments};
pub use error::NodeError;
pub use event::Event;
pub use file_lock::{FileLock, LockError};
pub use file_size::let_long_files_fail;
pub use managed::{Managed, Stopped, main, main_reporting};
pub use start::Node;
