//! ROS messages: of a state, and of what stays as it is.

mod markers;
mod states;
mod transforms;

pub(crate) use markers::markers;
pub(crate) use states::{
    Snapshot, intervention, invariants, joint_state, odometry, state_header, system_state,
};
pub(crate) use transforms::{static_transforms, transforms};
