//! Actions: goals that take time, can be watched and cancelled, and end with a result.
//!
//! An [`ActionServer`] speaks the protocol of ROS 2 on a thread of its own: three services (`send_goal`, `cancel_goal`,
//! `get_result`) and two topics (`feedback`, `status`) below `<name>/_action`. What works on the goals takes them one by
//! one from [`ActionServer::next_goal`], each as a [`GoalHandle`] that says whether it is to stop and takes feedback and
//! result. None of it waits for the network.
//!
//! Source: <https://design.ros2.org/articles/actions.html>; in doubt the server does as `rcl_action` and `rclcpp` do.
//!
//! # Assumptions and limitations
//! - A second request to cancel a goal is answered like the first; `rcl_action` calls it an error.
//! - A goal that is cancelled, or preempted, before it was taken up ends at once, with the default result.
//! - At most 16 goals are active at a time, and 16 results of 64 MiB together are kept, for 15 minutes. Of 64 unsent
//!   feedback messages the oldest are dropped.
//! - A result that is too long to be sent (see the limitations of services) is [shortened](ActionServer::shortened_by), or
//!   replaced by the default one, with a warning in the log.
//! - [Services](super::ServiceServer)' limitations apply.

mod client;
mod goals;
mod handle;
mod protocol;
mod server;
mod table;

use std::fmt;

use lgvi_msgs::{action_msgs::GoalStatus, unique_identifier_msgs::UUID};
use uuid::Uuid;

pub use client::{ActionClient, GoalOutcome, SendGoalError};
pub use handle::{GoalHandle, StopReason};
pub use server::ActionServer;
pub use table::Decision;

/// The identity of a goal, which its client has given it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GoalId(pub [u8; 16]);

impl GoalId {
    fn random() -> Self {
        Self(Uuid::new_v4().into_bytes())
    }

    fn message(self) -> UUID {
        UUID { uuid: self.0 }
    }
}

impl fmt::Display for GoalId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Uuid::from_bytes(self.0).fmt(f)
    }
}

/// Where a goal is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i8)]
pub enum GoalState {
    /// The server does not know the goal, or no longer.
    Unknown = GoalStatus::STATUS_UNKNOWN,
    /// It waits to be taken up.
    Accepted = GoalStatus::STATUS_ACCEPTED,
    /// It is being worked on.
    Executing = GoalStatus::STATUS_EXECUTING,
    /// It is to be stopped, as a client has asked for.
    Canceling = GoalStatus::STATUS_CANCELING,
    /// It has been reached.
    Succeeded = GoalStatus::STATUS_SUCCEEDED,
    /// It has been stopped as a client has asked for.
    Canceled = GoalStatus::STATUS_CANCELED,
    /// It has failed, or given way to another.
    Aborted = GoalStatus::STATUS_ABORTED,
}

impl GoalState {
    const ALL: [Self; 7] = [
        Self::Unknown,
        Self::Accepted,
        Self::Executing,
        Self::Canceling,
        Self::Succeeded,
        Self::Canceled,
        Self::Aborted,
    ];

    /// Whether the goal has come to its end.
    pub const fn is_terminal(self) -> bool {
        matches!(self, Self::Succeeded | Self::Canceled | Self::Aborted)
    }

    const fn code(self) -> i8 {
        self as i8
    }

    fn from_code(code: i8) -> Self {
        let known = Self::ALL.into_iter().find(|state| state.code() == code);
        known.unwrap_or(Self::Unknown)
    }
}

/// The name of one of an action's services or topics.
fn part(action: &str, part: &str) -> String {
    format!("{action}/_action/{part}")
}
